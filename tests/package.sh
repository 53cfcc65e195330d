#!/usr/bin/env bash
# The Debian package in a clean Debian: installed, crawling, upgraded and rolled back while it crawls, killed, hung, rebooted,
# removed, purged. Real packages by config/debian/build, a root by debootstrap, and its own systemd as process 1 in namespaces
# of its own, without a network. Takes some minutes, needs root and the tools named below; `.ci/run` does not call it.
#
#   tests/package.sh [FOLDER]     FOLDER keeps the packages and the root by debootstrap for the next run
set -Eeuo pipefail
cd "$(dirname "$0")/.."

skip() { echo "SKIPPED: $*"; exit 0; }
step() { printf '\n== %s\n' "$*"; }
fail() {
  echo "FAILED: $*" >&2
  in_root journalctl --no-pager --lines 60 >&2 || true
  exit 1
}

[ "$(id -u)" -eq 0 ] || skip "a root of its own needs root"
for tool in debootstrap unshare nsenter dpkg-deb cargo-deb openssl; do
  command -v "$tool" >/dev/null || skip "$tool is not installed"
done

kept=${1:-}
folder=${kept:-$(mktemp -d)}
root=$(mktemp -d)
manager= # systemd of the root, seen from here
clean_up() {
  if [ -n "$manager" ]; then kill -KILL "$manager" 2>/dev/null || true; fi
  rm -rf "$root"
  [ -n "$kept" ] || rm -rf "$folder"
}
trap clean_up EXIT
trap 'fail "line $LINENO: $BASH_COMMAND"' ERR

step "two packages of the same program, the second with a higher version"
version=$(cargo metadata --no-deps --format-version 1 | grep -oE '"name":"wormd","version":"[^"]+"' | cut -d'"' -f8)
old=$folder/wormd_${version}-1.deb
new=$folder/wormd_${version}-2.deb
config/debian/build --quiet --fast --deb-version "$version-1" --output "$old"
config/debian/build --quiet --fast --deb-version "$version-2" --output "$new"
ls -l "$old" "$new"

step "a clean Debian"
base=$folder/debian
if [ ! -e "$base/complete" ]; then
  rm -rf "$base"
  mirror=${MIRROR:-$(apt-get indextargets --format '$(REPO_URI)' 2>/dev/null | sed -n 1p)}
  debootstrap --variant=minbase --include=systemd,systemd-sysv,dbus,udev "$(. /etc/os-release && echo "$VERSION_CODENAME")" \
    "$base" ${mirror:+"$mirror"} >"$folder/debootstrap.log" || fail "debootstrap: see $folder/debootstrap.log"
  touch "$base/complete"
fi
cp -a "$base/." "$root"
cp "$old" "$new" "$root/srv"
# This computer's devices are not the root's business.
for unit in systemd-udevd.service systemd-udevd-control.socket systemd-udevd-kernel.socket systemd-udev-trigger.service; do
  ln -s /dev/null "$root/etc/systemd/system/$unit"
done

# Runs as process 1 of the namespaces: mounts what systemd needs, and becomes systemd.
start_systemd() {
  local root=$1 device
  mount --make-rprivate /
  mount --bind "$root" "$root"
  mount -t proc proc "$root/proc"
  mount -t sysfs sysfs "$root/sys"
  mount -t tmpfs -o mode=755 tmpfs "$root/sys/fs/cgroup" 2>/dev/null && mkdir "$root/sys/fs/cgroup/systemd" "$root/sys/fs/cgroup/unified"
  mount -t cgroup -o none,name=systemd cgroup "$root/sys/fs/cgroup/systemd" 2>/dev/null || true
  mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup/unified" || mount -t cgroup2 cgroup2 "$root/sys/fs/cgroup"
  mount -t tmpfs -o mode=755 tmpfs "$root/dev"
  for device in null zero full random urandom tty; do
    touch "$root/dev/$device"
    mount --bind "/dev/$device" "$root/dev/$device"
  done
  mkdir "$root/dev/pts" "$root/dev/shm"
  mount -t devpts -o newinstance,ptmxmode=0666,mode=620,gid=5 devpts "$root/dev/pts"
  ln -s pts/ptmx "$root/dev/ptmx"
  mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
  mount -t tmpfs -o mode=755 tmpfs "$root/run"
  cd "$root"
  mkdir -p old
  pivot_root . old
  umount -l /old
  rmdir /old
  export container=wormd-test
  exec /lib/systemd/systemd --log-target=journal
}
export -f start_systemd

in_root() { nsenter --target "$manager" --mount --pid --ipc --net --uts --cgroup -- "$@"; }

boot() {
  unshare --mount --pid --uts --ipc --net --cgroup --fork --kill-child bash -ec "start_systemd '$root'" </dev/null >"$root/srv/boot.log" 2>&1 &
  local unshare=$!
  for _ in $(seq 300); do
    manager=$(cat "/proc/$unshare/task/$unshare/children" 2>/dev/null | tr -d ' ' || true)
    if [ -n "$manager" ] && [[ $(in_root systemctl is-system-running 2>/dev/null) =~ running|degraded ]]; then return; fi
    sleep 0.2
  done
  cat "$root/srv/boot.log"
  fail "systemd does not start in namespaces here"
}

power_off() {
  in_root systemctl poweroff || true
  for _ in $(seq 300); do
    if [ ! -e "/proc/$manager" ]; then manager=; return; fi
    sleep 0.2
  done
  fail "it does not go down"
}

# As the worm's user.
worm() { in_root setpriv --reuid wormd --regid wormd --init-groups -- wormd "$@"; }
wait_for() { # what, seconds, command
  local what=$1 seconds=$2
  shift 2
  for _ in $(seq $((seconds * 5))); do
    if "$@"; then return; fi
    sleep 0.2
  done
  fail "waited $seconds s in vain: $what"
}
stands() { in_root wormd status | grep -q "^worm1: $1 "; }
property() { in_root systemctl show --property "$2" --value "wormd-$1@worm1.service"; }
# Of the target's own stop systemctl does not wait for what it stops with it.
stop_all() {
  in_root systemctl stop wormd@worm1.target
  for unit in control estimate record black-box virtual-worm; do
    wait_for "the end of $unit" 30 eval '[[ $(property $unit ActiveState) =~ inactive|failed ]]'
  done
}
is_failed() { [ "$(property control ActiveState)" = failed ]; }
restarts_disarmed() {
  local override=/etc/systemd/system/wormd-control@worm1.service.d killed
  in_root mkdir "$override"
  printf '[Service]\nRestartPreventExitStatus=\n' | in_root tee "$override/override.conf" >/dev/null
  in_root systemctl daemon-reload
  killed=$(property control MainPID)
  kill_controller KILL
  wait_for "another controller" 20 eval '[[ $(property control MainPID) != '"$killed"' ]] && stands disarmed'
  in_root rm -r "$override"
  in_root systemctl daemon-reload
}
kill_controller() { in_root sh -c 'kill -s "$0" "$1"' "$1" "$(property control MainPID)"; }
same_process() { # what
  [ "$(property control MainPID)" = "$pid" ] || fail "$1: another controller"
  [ "$(property estimate MainPID)" = "$estimator" ] || fail "$1: another estimator"
  stands crawling || fail "$1: the worm does not crawl any more"
  echo "$1: controller $pid and estimator $estimator go on, and the worm crawls"
}

boot
in_root systemctl --version | sed -n 1p

step "install, without a network: nothing runs, nothing is enabled"
in_root apt-get install --yes --quiet "/srv/$(basename "$old")" </dev/null | tail -n 3
in_root id wormd
in_root wormd status
[ -z "$(in_root systemctl list-units --all --plain --no-legend 'wormd*')" ] || fail "a unit was started"
for page in wormd.1 wormd-control.1 wormd-status.1; do [ -s "$root/usr/share/man/man1/$page.gz" ] || fail "no page $page"; done

step "the units: verify, and the exposure that systemd finds"
in_root systemd-analyze verify --man=no wormd@worm1.target wormd-{control,estimate,record,black-box,crawl,virtual-worm,bridge}@worm1.service
for unit in control estimate record black-box crawl virtual-worm bridge; do
  in_root systemd-analyze security --offline=yes --threshold=20 --no-pager "wormd-$unit@worm1.service" | tail -n 1
done

step "the rule for the adapter: read without complaint (there is no adapter here)"
complaint=$(in_root udevadm test /sys/class/tty/tty0 2>&1 | grep '70-wormd.rules:' || true)
[ -z "$complaint" ] || fail "$complaint"

step "no port: refused in words, and tried again"
in_root systemctl start wormd@worm1.target
wait_for "a second attempt" 20 eval '[ "$(property control NRestarts)" -ge 1 ]'
in_root journalctl --no-pager --output cat --unit wormd-control@worm1.service | grep -A 1 ERROR | tail -n 2 || fail "nothing says why"
stop_all

step "start on the virtual worm: disarmed"
printf '[port]\npath = "/run/wormd/worm1/port"\n' | in_root tee /etc/wormd/worm1.toml >/dev/null
in_root systemctl enable --quiet wormd-virtual-worm@worm1.service wormd-record@worm1.service \
  wormd-black-box@worm1.service wormd@worm1.target
in_root systemctl start wormd@worm1.target
wait_for "a worm" 20 stands disarmed
[ "$(property control StatusText)" = disarmed ] || fail "the status is $(property control StatusText)"
pid=$(property control MainPID)
estimator=$(property estimate MainPID)
in_root grep -E '^(Uid|CapEff|CapBnd|NoNewPrivs|Seccomp):' "/proc/$pid/status"
in_root chrt --pid "$pid"
in_root journalctl --no-pager --output cat --unit wormd-control@worm1.service | grep -E 'REFUSED' || echo "nothing that the loop requests was refused"

step "black box: with the worm, as its user"
wait_for "the black box" 20 eval '[ "$(property black-box ActiveState)" = active ]'
in_root test -d /var/lib/wormd/worm1/black-box || fail "the black box has no folder"

step "bridge: refused in words without its file, there with it, and started again when it was killed"
if in_root systemctl start wormd-bridge@worm1.service; then fail "a bridge without a file"; fi
[ "$(property bridge ExecMainStatus)" = 2 ] || fail "the bridge ended with $(property bridge ExecMainStatus)"
in_root journalctl --no-pager --output cat --unit wormd-bridge@worm1.service | grep 'worm1-bridge.toml' || fail "nothing says why"
config/bridge/make-keys "$root/etc/wormd/keys" authority
config/bridge/make-keys "$root/etc/wormd/keys" robot robot1 127.0.0.1
in_root chown -R wormd:wormd /etc/wormd/keys
printf '%s\n' 'certificate = "keys/robot1.pem"' 'key = "keys/robot1.key"' 'authority = "keys/ca.pem"' 'listen = ["tls/127.0.0.1:7447"]' \
  '[access]' 'watch = ["anna"]' '[[worms]]' 'name = "worm1"' | in_root tee /etc/wormd/worm1-bridge.toml >/dev/null
in_root systemctl start wormd-bridge@worm1.service
in_root sh -c 'kill -s KILL "$0"' "$(property bridge MainPID)"
wait_for "another bridge" 20 eval '[ "$(property bridge NRestarts)" = 1 ] && [ "$(property bridge ActiveState)" = active ]'
in_root systemctl stop wormd-bridge@worm1.service
[ "$(property bridge Result)" = success ] || fail "the bridge ended with $(property bridge Result)"
in_root rm -r /etc/wormd/keys /etc/wormd/worm1-bridge.toml

step "crawl"
worm command arm --name worm1
worm command crawl --for 600 --name worm1
wait_for "the status" 5 eval '[ "$(property control StatusText)" = crawling ]'
same_process "before the upgrade"

step "upgrade while it crawls"
in_root apt-get install --yes --quiet "/srv/$(basename "$new")" </dev/null | grep '^wormd:' -A 2 || fail "the upgrade says nothing about the worm"
[ "$(in_root dpkg-query --show --showformat '${Version}' wormd)" = "$version-2" ] || fail "not upgraded"
same_process "after the upgrade"
in_root wormd status | grep replaced || fail "the status does not show the old program"

step "the new program commands the old processes"
worm command hold --name worm1
worm command crawl --for 600 --name worm1

step "roll back while it crawls, from a kept file"
in_root dpkg --install "/srv/$(basename "$old")" 2>&1 | tail -n 3
[ "$(in_root dpkg-query --show --showformat '${Version}' wormd)" = "$version-1" ] || fail "not rolled back"
same_process "after the roll-back"

step "no removal while it crawls"
if in_root dpkg --remove wormd; then fail "removed under a crawling worm"; fi
same_process "after the refused removal"

step "stop: the worm first, then estimator and recorder; no message was lost"
stop_all
for unit in control estimate record black-box; do
  [ "$(property $unit Result)" = success ] || fail "$unit ended with $(property $unit Result)"
done
in_root journalctl --sync
in_root journalctl --no-pager --output cat --unit wormd-record@worm1.service | grep '^recorded:' | tee "$folder/recorded"
grep -q 'state [0-9]* (0 lost), timing [0-9]* (0 lost)' "$folder/recorded" || fail "messages were lost"
log=$(in_root sh -c 'ls -t /var/lib/wormd/worm1/*.mcap | head -n 1')
in_root wormd replay "$log" | tail -n 3

step "a controller that is killed is not started again, and the next one is disarmed"
in_root systemctl start wormd@worm1.target
wait_for "a worm" 20 stands disarmed
worm command arm --name worm1
worm command crawl --for 600 --name worm1
kill_controller KILL
wait_for "a failed unit" 10 is_failed
sleep 5
is_failed || fail "it was started again"
in_root systemctl start wormd@worm1.target
wait_for "a worm" 20 stands disarmed

step "on the level it may be: with an empty RestartPreventExitStatus= it starts again by itself, disarmed"
restarts_disarmed

step "a controller that hangs is ended by the watchdog"
worm command arm --name worm1
worm command crawl --for 600 --name worm1
kill_controller STOP
wait_for "a failed unit" 60 is_failed
[ "$(property control Result)" = watchdog ] || fail "ended by $(property control Result)"
stop_all

step "restarted after an upgrade: the new program, disarmed"
in_root systemctl start wormd@worm1.target
wait_for "a worm" 20 stands disarmed
in_root dpkg --install "/srv/$(basename "$new")" >/dev/null
in_root wormd status | grep replaced || fail "the status does not show the old program"
in_root systemctl restart wormd@worm1.target
wait_for "the new program" 40 eval 'stands disarmed && ! in_root wormd status | grep -q replaced'

step "power off and on: it crawls only where wormd-crawl is enabled"
power_off
boot
wait_for "a worm" 20 stands disarmed
sleep 3
stands disarmed || fail "it moved without being told"
in_root systemctl enable --quiet wormd-crawl@worm1.service
power_off
boot
wait_for "a crawl at power-up" 20 stands crawling

step "after a crash it does not crawl again by itself, though the controller is started again"
restarts_disarmed
sleep 10
stands disarmed || fail "it moved without being told"
in_root systemctl start wormd-crawl@worm1.service
wait_for "a crawl" 10 stands crawling
in_root systemctl stop wormd-crawl@worm1.service
wait_for "a hold" 10 stands holding

step "remove, and purge: recordings stay"
worm command stop --name worm1
wait_for "disarmed" 10 stands disarmed
in_root dpkg --remove wormd 2>&1 | tail -n 2
[ -z "$(in_root sh -c 'ls -l /proc/[0-9]*/exe 2>/dev/null' | grep /wormd || true)" ] || fail "a process is left"
in_root dpkg --purge wormd 2>&1 | tail -n 2
[ -s "$root$log" ] || fail "a recording is lost"
step "without recordings nothing is left"
in_root apt-get install --yes --quiet "/srv/$(basename "$old")" </dev/null | tail -n 1
rm -r "$root/var/lib/wormd"
in_root dpkg --purge wormd
left=$(in_root sh -c 'find / -xdev -name "*wormd*" -not -path "/srv/*" -not -path "/proc/*" -not -path "/sys/*"; ls -d /dev/shm/*wormd* /run/wormd 2>/dev/null; getent passwd wormd || true')
[ -z "$left" ] || fail "left: $left"
echo "nothing is left"

step "passed"
