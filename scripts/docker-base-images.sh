#!/usr/bin/env bash
# docker-base-images.sh RELEASE POSTGRES: makes sure the engine has debian:RELEASE-slim and postgres:POSTGRES-RELEASE.
# Pulls what is missing; where no registry answers, makes stand-ins from Debian's packages under the same names.
set -euo pipefail
cd "$(dirname "$0")"

release=$1
postgres=$2
debian_image=debian:$release-slim
postgres_image=postgres:$postgres-$release
cache=${XDG_CACHE_HOME:-$HOME/.cache}/marey/images

say() { printf 'images: %s\n' "$*" >&2; }
die() { say "$*"; exit 1; }
is_there() { docker image inspect "$1" >/dev/null 2>&1; }

missing=()
for image in "$debian_image" "$postgres_image"; do
    is_there "$image" || timeout 600 docker pull --quiet "$image" >/dev/null 2>&1 || missing+=("$image")
done
((${#missing[@]})) || exit 0

# The mirror that this machine's apt uses.
mirror() {
    # shellcheck disable=SC2016 # the fields are apt's to expand
    local fields='$(CODENAME) $(RELEASE) $(COMPONENT) $(REPO_URI)'
    apt-get indextargets --format "$fields" 'Created-By: Packages' |
        awk -v release="$release" '$3 == "main" && ($1 == release || $2 == release) { print $4; exit }'
}

# Fills $rootfs with a minimal Debian, then with a PostgreSQL server, and keeps an archive of each.
make_archives() {
    command -v apt-get >/dev/null || die "no registry gives ${missing[*]}, and this is not Debian"
    ((EUID == 0)) || die "no registry gives ${missing[*]}: run as root to make stand-ins"
    if ! command -v debootstrap >/dev/null; then
        apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -yqq debootstrap </dev/null >/dev/null
    fi
    local from rootfs log
    from=$(mirror)
    [[ -n $from ]] || die "apt on this machine has no source for Debian $release"
    mkdir -p "$cache"
    rootfs=$(mktemp -d "$cache/rootfs.XXXXXX")
    log=$cache/$release.log
    # shellcheck disable=SC2064 # the folder of this call
    trap "rm -rf --one-file-system '$rootfs'" EXIT

    say "no registry gives ${missing[*]}: making stand-ins from Debian's packages (about a minute, once)"
    debootstrap --variant=minbase "$release" "$rootfs" "$from" >"$log" 2>&1 ||
        { tail -n 20 "$log" >&2; die "debootstrap failed, all it said is in $log"; }
    rm -rf "$rootfs"/var/cache/apt/archives/*.deb
    archive "$rootfs" "$(archive_of "$debian_image")"

    install -D postgres-image/createcluster.conf "$rootfs/etc/postgresql-common/createcluster.conf"
    install -m 755 postgres-image/entrypoint.sh "$rootfs/usr/local/bin/postgres-entrypoint"
    chroot "$rootfs" env DEBIAN_FRONTEND=noninteractive apt-get install -yqq --no-install-recommends \
        "postgresql-$postgres" >>"$log" 2>&1 </dev/null ||
        { tail -n 20 "$log" >&2; die "installing postgresql-$postgres failed, all it said is in $log"; }
    rm -rf "$rootfs"/var/cache/apt/archives/*.deb "$rootfs"/usr/share/{doc,man,locale}
    archive "$rootfs" "$(archive_of "$postgres_image")"
}
archive_of() { printf '%s/%s.tar' "$cache" "${1//:/-}"; }
archive() {
    tar -C "$1" --one-file-system --numeric-owner --exclude ./proc/\* --exclude ./sys/\* -cf "$2.part" .
    mv "$2.part" "$2"
}

for image in "${missing[@]}"; do
    [[ -e $(archive_of "$image") ]] || { make_archives; break; }
done
for image in "${missing[@]}"; do
    changes=()
    if [[ $image == "$postgres_image" ]]; then
        changes=(--change "ENV PATH=/usr/lib/postgresql/$postgres/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
            --change 'ENV LANG=C.UTF-8' --change 'ENV PGDATA=/var/lib/postgresql/data'
            --change 'ENTRYPOINT ["postgres-entrypoint"]' --change 'CMD ["postgres"]'
            --change 'EXPOSE 5432')
    else
        changes=(--change 'CMD ["bash"]')
    fi
    docker import "${changes[@]}" --message 'made from Debian packages' "$(archive_of "$image")" "$image" >/dev/null
    say "made $image"
done
