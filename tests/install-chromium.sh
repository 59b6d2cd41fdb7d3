#!/bin/sh
# Installs Chromium, in which the tests open pages, where there is none. Never fails: without it
# everything else works, and those tests say what they lack.
for name in "${CHROMIUM:-chromium}" chromium-browser google-chrome google-chrome-stable; do
  command -v "$name" > /dev/null && exit 0
done

advise() {
  echo "$1 Install a Chromium yourself, or name its program in the variable CHROMIUM;" >&2
  echo "until then the tests that open pages fail, and everything else works." >&2
  exit 0
}

command -v apt-get > /dev/null || advise "There is no Chromium here, and no apt-get."
as_root="env"
if [ "$(id -u)" != 0 ]; then
  as_root="sudo -n env"
  $as_root true 2> /dev/null || advise "There is no Chromium here, and no right to install it."
fi
apt() {
  $as_root DEBIAN_FRONTEND=noninteractive apt-get -qq -y --no-install-recommends "$@" > "$said" 2>&1
}

echo "Installing Chromium for the tests of pages ..."
said=$(mktemp)
trap 'rm -f "$said"' EXIT
packages="chromium fonts-liberation"
# The lists of packages may be missing or old; fetching them takes a while, so only when needed.
if ! apt install $packages && ! { apt update && apt install $packages; }; then
  tail -n 5 "$said" >&2
  advise "Chromium could not be installed; above is what apt-get said."
fi
