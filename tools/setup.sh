#!/usr/bin/env bash
# Sets up a fresh Debian or Ubuntu machine: system libraries, virtual environment, the project.
# Does nothing in a fraction of a second when everything is there. VENV names the environment.
set -euo pipefail
cd "$(dirname "$0")/.."
VENV=${VENV:-.venv}
PACKAGES=(libusb-1.0-0 libgl1 libegl1 libosmesa6 libgomp1 libx11-6)

say() { printf 'setup: %s\n' "$*" >&2; }
installed() { [ "$(dpkg-query -W -f='${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

install_system_libraries() {
  if ! command -v dpkg-query >/dev/null; then
    say "not a Debian-like system; make sure that libusb-1.0, libGL, libEGL and libOSMesa are installed"
    return
  fi
  local missing=()
  for package in "$@"; do installed "$package" || missing+=("$package"); done
  [ ${#missing[@]} -eq 0 ] && return
  local sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    if ! command -v sudo >/dev/null || { [ ! -t 0 ] && ! sudo -n true 2>/dev/null; }; then
      say "system libraries are missing; install them, then run this again: apt-get install ${missing[*]}"
      exit 1
    fi
    sudo=(sudo)
  fi
  say "installing ${missing[*]}"
  # A Debian mirror that is briefly out of step fails the update; the installation decides.
  "${sudo[@]}" apt-get update -qq || true
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    "${missing[@]}" >/dev/null
}

find_python() {
  for candidate in "${PYTHON3:-}" python3.11 python3.12 python3.13 python3; do
    [ -n "$candidate" ] && command -v "$candidate" >/dev/null || continue
    if "$candidate" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))'; then
      echo "$candidate"
      return
    fi
  done
  say "no Python 3.11, 3.12 or 3.13 found; install one (apt-get install python3 python3-venv)"
  exit 1
}

create_environment() {
  local python
  python=$(find_python)
  if ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    install_system_libraries python3-venv
  fi
  rm -rf "$VENV"
  say "creating $VENV with $("$python" --version)"
  "$python" -m venv "$VENV"
}

# Whatever changes what is installed changes this line; it is written only after success.
wanted=$(cat pyproject.toml constraints.txt tools/setup.sh | sha256sum | cut -d' ' -f1)
stamp="$VENV/.sr_mj_installed"

install_system_libraries "${PACKAGES[@]}"
if [ "$(cat "$stamp" 2>/dev/null)" = "$wanted" ]; then exit 0; fi
[ -x "$VENV/bin/python" ] && "$VENV/bin/python" -m pip --version >/dev/null 2>&1 || create_environment
say "installing the project and its dependencies (torch makes it several GB; minutes, once)"
"$VENV/bin/python" -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[dev]"
echo "$wanted" >"$stamp"
