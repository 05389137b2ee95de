use std::{
    ffi::OsString,
    fs::File,
    io::{self, Write},
    path::{Path, PathBuf},
};

use crate::{Error, Result};

/// Containers that are opened: those of cameras, phones and screen recorders, none of which names other files. Playlists
/// do and would let an upload read whatever file its text names.
const CONTAINERS: &str = "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,avi,mpegts,mpeg,mpegvideo,h264,hevc,mjpeg,gif,asf,flv,mxf,\
                          image2pipe,png_pipe,jpeg_pipe";

/// Where frames come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Source {
    /// a video file
    Video(PathBuf),
    /// pictures, in this order: all PNG or all JPEG by their names' endings
    Images {
        /// the files
        files: Vec<PathBuf>,
        /// pictures a second
        rate: f64,
    },
}

impl Source {
    /// A video file.
    pub fn video(path: impl Into<PathBuf>) -> Self {
        Self::Video(path.into())
    }

    /// What errors name: the file, or the first of them.
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::Video(path) => path,
            Self::Images { files, .. } => files.first().map_or(Path::new(""), PathBuf::as_path),
        }
    }

    /// Checks what can be known without a program: files that open, pictures of one kind.
    pub(crate) fn check(&self) -> Result<()> {
        let path = self.path();
        if let Self::Images { files, rate } = self {
            let fail = |what: String| Err(Error::Option { what });
            if files.is_empty() {
                return fail("found no pictures, expected at least one".into());
            }
            if !(rate.is_finite() && *rate > 0.0) {
                return fail(format!("rate is {rate} pictures a second, expected a positive number"));
            }
            let codec = codec(path)?;
            for file in files {
                if self::codec(file)? != codec {
                    return fail(format!(
                        "found pictures of two kinds, {} and {}, expected all PNG or all JPEG",
                        path.display(),
                        file.display()
                    ));
                }
            }
        }
        let file = |source| Error::File { path: path.into(), source };
        let metadata = File::open(path).and_then(|opened| opened.metadata()).map_err(file)?;
        if !metadata.is_file() {
            return Err(file(io::Error::other("not a file")));
        }
        Ok(())
    }

    /// What the programs are told before the input. Decoders count the margins that they add; what is only a little too
    /// large is refused by us, with its size.
    pub(crate) fn guards(max_pixels: u64) -> Vec<OsString> {
        let pixels = max_pixels.saturating_mul(2).saturating_add(1 << 20).to_string();
        ["-protocol_whitelist", "file,pipe", "-format_whitelist", CONTAINERS, "-max_pixels", &pixels]
            .map(OsString::from)
            .to_vec()
    }

    /// What names the input.
    pub(crate) fn input(&self) -> Result<Vec<OsString>> {
        Ok(match self {
            // with the protocol in front, no name is taken for an option or an address
            Self::Video(path) => vec!["-i".into(), as_file(path)],
            Self::Images { rate, .. } => {
                let rate = rate.to_string();
                ["-f", "image2pipe", "-framerate", &rate, "-c:v", codec(self.path())?, "-i", "pipe:0"]
                    .map(OsString::from)
                    .to_vec()
            }
        })
    }
}

/// A path that programs take for nothing but a file.
pub(crate) fn as_file(path: &Path) -> OsString {
    let mut name = OsString::from("file:");
    name.push(path);
    name
}

fn codec(path: &Path) -> Result<&'static str> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_ascii_lowercase();
    match ending.as_str() {
        "png" => Ok("png"),
        "jpg" | "jpeg" => Ok("mjpeg"),
        _ => Err(Error::Option { what: format!("{} is not named .png, .jpg or .jpeg", path.display()) }),
    }
}

/// Writes all files, one after the other. Ends early when the reader is gone.
pub(crate) fn feed(files: &[PathBuf], mut to: impl Write) -> Result<()> {
    for path in files {
        let file = |source| Error::File { path: path.clone(), source };
        let mut picture = File::open(path).map_err(file)?;
        if let Err(source) = io::copy(&mut picture, &mut to) {
            return if source.kind() == io::ErrorKind::BrokenPipe { Ok(()) } else { Err(file(source)) };
        }
    }
    Ok(())
}
