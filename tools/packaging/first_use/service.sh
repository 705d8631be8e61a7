#!/usr/bin/env bash
# First use of postchain-service, in a system that systemd has booted, as root: installs the packages in this folder,
# which apt has downloaded already with all that they need; runs a job; adds a token by reload; restarts; removes all.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
apt-get install -q=2 -y --no-install-recommends ./*.deb libgl1-mesa-dri libegl-mesa0 >/dev/null
dpkg-query -W -f '${Package} ${Version} ${Status}\n' 'postchain*'

token=$(</etc/postchain/admin.token)
ask() { # path and options of curl: the status, and the answer if it is another than 2xx
    curl -sS --fail-with-body -H "Authorization: Bearer $token" "http://127.0.0.1:8080$1" "${@:2}"
}
status() { curl -sS -o /dev/null -w '%{http_code}\n' -H "Authorization: Bearer $1" http://127.0.0.1:8080/v1/jobs; }
expect() { [[ $2 == "$3" ]] || { echo "$1: $2 in place of $3" >&2; systemctl status postchain >&2; exit 1; }; }

systemctl is-enabled postchain
systemctl is-active postchain
expect "a wrong token" "$(status wrong)" 401

echo "== a job"
cd /srv/postchain
umask 002
as_service=(runuser -u postchain --)
"${as_service[@]}" postchain scene wheels -o shots --frames 1-2 --size 160x90 --device software
"${as_service[@]}" mkdir out
ask /v1/jobs -H 'Content-Type: application/json' -d '{"kind": "run", "chain": "fast", "input": "shots/sharp.####.exr",
    "camera": "shots/camera.json", "output": "out/wheels.####.exr"}'
echo
ask /v1/jobs/1/events -N
ask /v1/jobs/1 | grep -q '"state":"done"'
ls -l out

echo "== reload: a second token"
main=$(systemctl show -p MainPID --value postchain)
echo -n 0123456789abcdef0123456789abcdef >second
expect "the second token before" "$(status "$(<second)")" 401
sed -i "s/tokens: \[/&$(postchain serve --hash-token second), /" /etc/postchain/users.yaml
systemctl reload postchain
for ((i = 0; i < 50; ++i)); do
    [[ $(status "$(<second)") == 401 ]] || break
    sleep 0.1
done
expect "the second token" "$(status "$(<second)")" 200
expect "the process after a reload" "$(systemctl show -p MainPID --value postchain)" "$main"

echo "== restart: the job is kept"
systemctl restart postchain
ask /v1/jobs/1 | grep -q '"state":"done"'

echo "== the package again, and its removal"
apt-get install -q=2 -y --reinstall /try/postchain-service_*.deb >/dev/null
systemctl is-active postchain
ask /v1/jobs/1 | grep -q '"state":"done"'
journalctl -u postchain --no-pager -o cat | tail -n 20
apt-get purge -q=2 -y postchain-service >/dev/null
expect "the unit after the removal" "$(systemctl is-active postchain || true)" inactive
[[ ! -e /var/lib/postchain && ! -e /etc/postchain/users.yaml && -e out/wheels.0002.exr ]]
echo "the service was installed, used, reloaded, restarted and removed"
