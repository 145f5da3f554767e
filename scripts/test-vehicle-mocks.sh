#!/usr/bin/env bash
# The acceptance run of make test-vehicle against the mock vehicle of both firmwares at once, sixty times as fast as life.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mkdir -p out/vehicle
make --no-print-directory .venv/ready
python=.venv/bin/python
mocks=()
runs=()
trap 'kill "${mocks[@]}" 2>/dev/null || true' EXIT

for firmware in ardupilot px4; do
  log="out/vehicle/mock-$firmware.txt"
  "$python" -m sitl_mock --firmware "$firmware" --conn tcpin:127.0.0.1:0 --home 47.3977,8.5456,488 --speed 60 >"$log" &
  mocks+=($!)
  for _ in $(seq 100); do
    conn=$(sed -nE 's/.*listening on tcpin:(127\.0\.0\.1:[0-9]+).*/tcp:\1/p' "$log")
    [[ -n $conn ]] && break
    sleep 0.1
  done
  [[ -n $conn ]] || { echo "the mock $firmware did not start"; exit 1; }
  make --no-print-directory test-vehicle CONN="$conn" SIM=1 >"out/vehicle/run-$firmware.txt" 2>&1 &
  runs+=($!)
done

failed=0
for run in "${runs[@]}"; do
  wait "$run" || failed=1
done
cat out/vehicle/run-*.txt
exit "$failed"
