# Functions of the transcripts beside this file (tests/command/transcript_test.py).
SAME='X-Content-Type-Options: nosniff
Referrer-Policy: no-referrer
Cross-Origin-Resource-Policy: same-origin
Cache-Control: no-store
Content-Security-Policy: default-src '"'none'; frame-ancestors 'none'"
# Members of /readyz that depend on the kernel are left out.
VARYING='s/,"confined":(true|false)//; s/^Date: .*/Date: TIME/; s/\b[0-9a-f]{8}-[0-9]+\b/REQUEST/g; s/127\.0\.0\.1:[0-9]+/ADDRESS/
s#'"${PWD%/*}"'/farm#FARM#g; s/postchain-[0-9a-f]{32}/NAME/g; s/\b(flip|is|by|with) 0\.0[0-9]{2,}/\1 ERROR/g
/^data: /s/"filter_ms":[0-9.]+/"filter_ms":T/'

# Starts a service over the folder, with these options.
serve() {
    rm -f address
    (
        timeout --foreground 300 postchain serve --root . --store jobs.sqlite --port 0 --device software "$@" \
            >address 2>>log &
        echo $! >pid
        wait $!
        echo "exit code $?" >>log
    ) >/dev/null 2>&1 &
    until [ -s address ] || grep -sq '^exit code' log; do sleep 0.02; done
}
# Waits until the command succeeds.
await() {
    local i
    for i in {1..1500}; do
        "$@" && return
        sleep 0.02
    done
    echo "not within 30 s: $*"
}
# says WORD PATH [WORD OF CURL ...]: whether the reply has the word.
says() { curl -s "$(cat address)$2" "${@:3}" | grep -q "$1"; }
# reply PATH [WORD OF CURL ...]: all headers and the body.
reply() { curl -sSi "$(cat address)$1" "${@:2}" | tr -d '\r' | sed -E "$VARYING"; }
own() {  # without what every reply has
    grep -avxF "$SAME" | sed -E '/^(Date|X-Request-Id|Content-Length): /d
        /^Content-Type: application\/json$/d; s/^HTTP\/1.1 //; /^$/d'
}
# ask METHOD PATH [BODY] [WORD OF CURL ...]: the headers that not every reply has, and the body.
ask() {
    local body=()
    [ $# -lt 3 ] || [[ $3 == -* ]] || body=(-H 'Content-Type: application/json' -d "$3")
    reply "$2" -X "$1" "${body[@]}" "${@:$((3 + (${#body[@]} > 0)))}" | own | pretty |
        sed -E 's/^( *"bytes"): [1-9][0-9]*/\1: N/'
}
# as USER METHOD PATH ...: with the user's token.
as() { ask "${@:2}" -H "$(token "$1")"; }
token() { echo "Authorization: Bearer $1-0123456789abcdef"; }
# got FILE PATH [WORD OF CURL ...]: the headers; the body is in the file.
got() { curl -sSD - -o "$1" "$(cat address)$2" "${@:3}" | tr -d '\r' | sed -E "$VARYING" | own; }
# Ends the service and prints its log, the lines of requests last.
stop() {
    kill "$(cat pid)"
    until grep -q '^exit code' log; do sleep 0.02; done
    { grep -v '"audit"\| at 127' log; grep '"audit"\| at 127' log; } |
        sed -E "$VARYING; s/(\"seconds\"):[0-9.e-]+/\\1:T/; /[0-9]+ of 400 /s/(: |\"frames\":)[0-9]+/\\1N/g"
    rm log
}
# The counters in the order of their names, times and sizes replaced.
metrics() {
    ask GET metrics "$@" | LC_ALL=C sort | sed -E 's/^((process|postchain_(store|http_connections))[a-z_]*) .*/\1 N/
        s/^([a-z_]*seconds_(sum|bucket\{.*le="[0-9.]+"\}).*) .*/\1 N/; s/(seconds_sum) .*/\1 N/'
}
# raw TEXT: sends the text of this printf format, whose lines end with \r\n, and prints the replies.
raw() {
    exec 3<>"/dev/tcp/127.0.0.1/$(sed -E 's#.*:([0-9]+)/.*#\1#' address)"
    # shellcheck disable=SC2059
    printf "${1//$'\n'/$'\r\n'}" >&3
    timeout 10 cat <&3 | tr -d '\r' | sed -E "$VARYING" | grep -avxF "$SAME" | sed -E '/^(Date|X-Request-Id): /d; /^$/d'
    exec 3<&-
}
