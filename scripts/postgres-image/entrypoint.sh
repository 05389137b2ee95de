#!/bin/bash
# Entry point of the stand-in for the official postgres image: the part of its behaviour that Marey uses.
# POSTGRES_USER, POSTGRES_PASSWORD, POSTGRES_DB and PGDATA mean the same as there.
set -euo pipefail

user=${POSTGRES_USER:-postgres}
database=${POSTGRES_DB:-$user}

if [[ $(id -u) == 0 ]]; then
    install -d -o postgres -g postgres -m 700 "$PGDATA"
    install -d -o postgres -g postgres -m 2775 /var/run/postgresql
    exec setpriv --reuid=postgres --regid=postgres --init-groups "$0" "$@"
fi

if [[ ! -s $PGDATA/PG_VERSION ]]; then
    : "${POSTGRES_PASSWORD:?must be set for a new cluster}"
    initdb --username "$user" --pwfile <(printf '%s\n' "$POSTGRES_PASSWORD") \
        --auth-local trust --auth-host scram-sha-256
    printf 'host all all all scram-sha-256\n' >>"$PGDATA/pg_hba.conf"
    # on its socket only: who asks by TCP is told "ready" by the real server alone
    pg_ctl --wait --options "-c listen_addresses=''" start
    if [[ $database != postgres ]]; then
        createdb --username "$user" --maintenance-db postgres "$database"
    fi
    pg_ctl --wait --mode fast stop
fi

exec "$@" -c listen_addresses='*'
