#!/bin/sh
# Run `make install`, `make demo` and `make test` of this commit in a folder that holds a bare Debian 12:
# its minimal system, python3-venv, make and git, and for the ways that say so gcc.
#
# BARE_ARGS has more words for pytest.
#
#   bare.sh [root] [root-gcc] [user] [user-gcc]     the ways to try; without words, all four
#
# Needs root, debootstrap and a package index. The clone of root lies in its home, which nobody else may
# enter. After `make install` the commands have no network but loopback, and few environment variables.
set -eu
cd "$(dirname "$0")/../.."
[ $# -gt 0 ] || set -- root root-gcc user user-gcc
[ "$(id -u)" = 0 ] && command -v debootstrap >/dev/null || {
    echo 'bare.sh needs root and debootstrap' >&2
    exit 2
}
umask 022
: "${BARE_ARGS:=}"
work=$PWD/build/bare
mkdir -p "$work/packages"

# Run a command in the folder $root as $name, without the variables of this shell but those of pip and proxies.
inside() {
    # shellcheck disable=SC2046
    chroot --userspec="$name:$name" "$root" /usr/bin/env -i \
        $(env | grep -E '^(PIP_[A-Z_]*|[a-z]*_proxy|[A-Z]*_PROXY)=[^[:space:]]*$') \
        PATH=/usr/local/bin:/usr/bin:/bin HOME="$home" sh -c "cd '$home/idlc' && $1"
}

# The part below runs again as the first process of namespaces of its own, which end with it.
if [ "${BARE_ROOT:-}" ]; then
    root=$BARE_ROOT name=$BARE_NAME home=$BARE_HOME
    mount -t proc proc "$root/proc"
    mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
    mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm" # without it Python has no locks between processes
    if [ "$BARE_STEP" = test ]; then
        python3 -c 'import fcntl, socket, struct
fcntl.ioctl(socket.socket(), 0x8914, struct.pack("16sh22x", b"lo", 0x1 | 0x40 | 0x1000))' # up, running, multicast
        inside "make demo && make test ARGS='$BARE_ARGS'"
    else
        inside 'make install'
    fi
    exit
fi

passed='' failed=''
for way; do
    name=${way%-gcc}
    home=/home/$name && [ "$name" != root ] || home=/root
    root=$work/$way
    rm -rf --one-file-system "$root"
    compiler='' && [ "$name" = "$way" ] || compiler=,gcc,libc6-dev
    echo "== $way: a bare Debian with python3-venv, make, git$compiler"
    debootstrap --variant=minbase --cache-dir="$work/packages" \
        --include="python3-venv,make,git,ca-certificates$compiler" bookworm "$root" >"$work/$way.log" || {
        tail "$work/$way.log" >&2
        exit 2
    }
    # how this machine reaches a package index
    for file in /etc/resolv.conf /etc/hosts /etc/pip.conf "${PIP_CERT:-/etc/ssl/certs/ca-certificates.crt}"; do
        [ ! -f "$file" ] || cp "$file" "$root$file"
    done
    [ "$name" = root ] || chroot "$root" useradd --create-home --shell /bin/sh "$name"
    git clone --quiet --no-local . "$root$home/idlc"
    chroot "$root" chown -R "$name:$name" "$home/idlc"
    export BARE_ROOT="$root" BARE_NAME="$name" BARE_HOME="$home"
    if BARE_STEP=install unshare --mount --pid --fork --kill-child sh "$0" &&
        BARE_STEP=test unshare --mount --pid --net --fork --kill-child sh "$0"; then
        passed="$passed $way"
        rm -rf --one-file-system "$root"
    else
        failed="$failed $way" # its folder is left for a look
    fi
    unset BARE_ROOT
done
echo "passed:${passed:- none}; failed:${failed:- none}"
[ -z "$failed" ]
