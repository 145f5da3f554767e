#!/usr/bin/env bash
# Makes .venv-mavproxy: MAVProxy as a foreign client for tests/interop, without the 1 GB of maps and video that its
# headless mission module never loads. Does nothing where it is there already. PYTHON=/path/to/python3 chooses another.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

venv=.venv-mavproxy
packages=(
  MAVProxy==1.8.75   # GPL-3, so it stays in an environment of its own and is only ever run as a program
  pymavlink==2.4.50
  pyserial==3.5
  fastcrc==0.5.0
  lxml==6.1.3
)
made="$venv/made-of"

if [[ -x $venv/bin/python && -f $made && $(<"$made") == "${packages[*]}" ]]; then
  exit 0
fi

python=${PYTHON:-}
if [[ -z $python ]]; then
  for python in .venv/bin/python python3; do
    command -v "$python" >/dev/null && break
  done
fi
rm -rf "$venv"
"$python" -m venv "$venv"
PIP_DISABLE_PIP_VERSION_CHECK=1 "$venv/bin/python" -m pip install -qq --no-deps "${packages[@]}"
"$venv/bin/python" "$venv/bin/mavproxy.py" --version >/dev/null 2>&1
printf '%s' "${packages[*]}" >"$made"
