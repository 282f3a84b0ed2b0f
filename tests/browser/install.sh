#!/bin/sh
# What the browser tests need: Debian's chromium and node, playwright-core from npm (which brings no browser of its own) in
# a folder of the user's cache, outside of the project.
set -eu
need=""
for program in chromium node npm; do
    command -v "$program" >/dev/null 2>&1 || need="$need $program"
done
if [ -n "$need" ]; then
    need=$(echo "$need" | sed 's/ node/ nodejs/')
    sudo=""
    [ "$(id -u)" -eq 0 ] || sudo="sudo"
    $sudo apt-get update
    # shellcheck disable=SC2086
    $sudo apt-get install --yes --no-install-recommends $need
fi
modules="${XDG_CACHE_HOME:-$HOME/.cache}/buildingmpc-browser"
mkdir -p "$modules"
npm install --no-save --no-audit --no-fund --no-package-lock --prefix "$modules" playwright-core@1.65.1
