//! Who runs the server: ourselves, unless we are root.

use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;

use crate::Error;

#[derive(Debug, Clone)]
pub(crate) enum ServerUser {
    Ourselves,
    Other { name: String, uid: u32, gid: u32 },
}

impl ServerUser {
    pub(crate) fn find() -> Result<Self, Error> {
        if !rustix::process::geteuid().is_root() {
            return Ok(Self::Ourselves);
        }
        let passwd = std::fs::read_to_string("/etc/passwd").map_err(Error::io("/etc/passwd"))?;
        ["postgres", "nobody"].iter().find_map(|name| parse_passwd(&passwd, name)).ok_or(Error::NoServerUser)
    }

    /// A command that this user runs.
    pub(crate) fn command(&self, program: &Path) -> Command {
        let mut command = Command::new(program);
        if let Self::Other { uid, gid, .. } = self {
            // Drops the supplementary groups as well.
            command.uid(*uid).gid(*gid);
        }
        // A home or a working folder of root would be closed to it.
        command.current_dir("/");
        for variable in ["PGDATA", "PGHOST", "PGPORT", "PGUSER", "PGDATABASE", "PGOPTIONS", "PGSERVICE"] {
            command.env_remove(variable);
        }
        command
    }

    /// Makes the folder (and those above) if need be, gives it to this user and closes it to all others.
    pub(crate) fn own_folder(&self, folder: &Path) -> Result<(), Error> {
        std::fs::create_dir_all(folder).map_err(Error::io(folder))?;
        if let Self::Other { uid, gid, name } = self {
            std::os::unix::fs::chown(folder, Some(*uid), Some(*gid)).map_err(Error::io(folder))?;
            for above in folder.ancestors().skip(1).filter(|above| !above.as_os_str().is_empty()) {
                let metadata = above.metadata().map_err(Error::io(above))?;
                let class = match (metadata.uid() == *uid, metadata.gid() == *gid) {
                    (true, _) => 0o100,
                    (_, true) => 0o010,
                    _ => 0o001,
                };
                if metadata.mode() & class == 0 {
                    return Err(Error::NotTraversable { folder: above.to_owned(), user: name.clone() });
                }
            }
        }
        std::fs::set_permissions(folder, std::fs::Permissions::from_mode(0o700)).map_err(Error::io(folder))
    }
}

fn parse_passwd(passwd: &str, wanted: &str) -> Option<ServerUser> {
    passwd.lines().find_map(|line| {
        let mut fields = line.split(':');
        let (name, _password) = (fields.next()?, fields.next()?);
        let (uid, gid) = (fields.next()?.parse().ok()?, fields.next()?.parse().ok()?);
        (name == wanted).then(|| ServerUser::Other { name: name.to_owned(), uid, gid })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_user_is_found_by_its_whole_name() {
        let passwd =
            "root:x:0:0:root:/root:/bin/bash\npostgresql:x:7:7::/:/bin/sh\npostgres:x:101:104:,,,:/:/bin/sh";
        let found = parse_passwd(passwd, "postgres");
        assert!(matches!(found, Some(ServerUser::Other { uid: 101, gid: 104, .. })), "{found:?}");
        assert!(parse_passwd(passwd, "nobody").is_none());
    }
}
