#!/usr/bin/env bash
# tests/namespaces.sh: service and player in network namespaces of their own, behind a link that is slow (tbf) or goes away; every tick
# that was sent is to be accounted for. Needs root, ip, tc and python3; built programs (`cargo build --release --workspace --bins`).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

for tool in ip tc python3; do
    command -v "$tool" >/dev/null || { echo "skipped: $tool not found"; exit 0; }
done
service=isotherm-$$-a player=isotherm-$$-b
if [ "$(id -u)" != 0 ] || ! ip netns add "$service" 2>/dev/null; then
    echo "skipped: namespaces need root"
    exit 0
fi
work=$(mktemp -d)
end() {
    jobs -p | xargs -r kill 2>/dev/null || true
    wait
    ip netns del "$service" 2>/dev/null || true
    ip netns del "$player" 2>/dev/null || true
    rm -rf "$work"
}
trap end EXIT
ip netns add "$player"
ip link add veth0 netns "$service" type veth peer name veth0 netns "$player"
place=1
for name in "$service" "$player"; do
    ip -n "$name" addr add 10.77.0.$place/24 dev veth0
    ip -n "$name" link set veth0 up
    ip -n "$name" link set lo up
    place=$((place + 1))
done
bin=target/release
$bin/isotherm-replay simulate --preset zeeman-rest --duration 100 --out "$work/log.csv" >"$work/simulate"
cat >"$work/service.toml" <<END
calibrations = "$PWD/config/calibration"
[pair]
lease_ms = 1000
END
ip netns exec "$service" $bin/isotherm serve --config "$work/service.toml" --listen tcp/10.77.0.1:7447 --log-level error \
    --ready-file "$work/ready" >"$work/totals" 2>&1 &
until [ -e "$work/ready" ]; do sleep 0.1; done

# rate NAME RATE: what passes in each direction.
rate() {
    for name in "$service" "$player"; do
        tc -n "$name" qdisc del dev veth0 root 2>/dev/null || true
        [ "$1" = none ] || tc -n "$name" qdisc add dev veth0 root tbf rate "$1" burst 8kb latency 100ms
    done
}

# Plays ten seconds as a unit of its own while COMMAND does something to the link; says what became of the ticks.
number=0
case_() {
    local what=$1 unit
    shift
    number=$((number + 1)) unit=NET-$number
    ip netns exec "$player" $bin/isotherm-replay play "$work/log.csv" --connect tcp/10.77.0.1:7447 --unit "$unit" --duration 10 --json \
        >"$work/$unit.json" 2>"$work/$unit.log" &
    local playing=$!
    sleep 2
    "$@"
    wait "$playing" || { echo "$what: exit code $?"; tail -n 5 "$work/$unit.log"; }
    rate none
    ip netns exec "$service" $bin/isotherm status "$unit" --json --connect 10.77.0.1:7447 >"$work/$unit.status"
    python3 - "$what" "$work/$unit.json" "$work/$unit.status" <<'END'
import json, sys
what, player, status = sys.argv[1], json.load(open(sys.argv[2])), json.load(open(sys.argv[3]))
unit = player["units"][0]
counters = {}
def find(value):
    if isinstance(value, dict):
        if set(value) >= {"name", "value"}:
            counters[value["name"]] = value["value"]
        counters.update({k: v for k, v in value.items() if isinstance(v, int)})
        for inner in value.values():
            find(inner)
    elif isinstance(value, list):
        for inner in value:
            find(inner)
find(status)
sent, back, lost = unit["ticks_sent"], unit["ticks_acknowledged"], unit["ticks_lost"]
came, missed, under_way = counters["gyro_ticks_in"], counters["ticks_missed"], unit["ticks_under_way"]
# Where playing ended with the connection, no later tick announces the last ones.
last = sent - came - missed
print(f"{what:24} sent {sent}  received {came}  announced {missed}  last ones that did not come {last}  "
      f"corrected and back {back}  lost {lost}  under way at the end {under_way}")
assert 0 <= last <= under_way, "on the way in"
assert sent == back + lost + unit["ticks_late"] + under_way, unit
END
}

down() {
    ip -n "$player" link set veth0 down
    sleep "$1"
    ip -n "$player" link set veth0 up
}

case_ "no fault" true
case_ "1 Mbit/s" rate 1mbit
case_ "200 kbit/s" rate 200kbit
case_ "link gone for 0.3 s" down 0.3
case_ "link gone for 3 s" down 3
