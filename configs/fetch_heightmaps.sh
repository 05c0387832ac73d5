#!/usr/bin/env bash
# Fetches the known heightmaps (kernels/heightmap.cpp) from Debian packages: fetch_heightmaps.sh FOLDER
# The packages are unpacked, not installed: slim systems drop /usr/share/doc. Needs apt, dpkg, unzip, coreutils.
set -euo pipefail

if [[ $# -ne 1 ]]; then
  echo "usage: $0 FOLDER" >&2
  exit 2
fi
mkdir -p "$1"
folder=$(cd "$1" && pwd)

# Name and size in bytes; a file of another size is fetched anew.
maps=("rocks_NM_height.tga 262188" "four_NM_height.tga 262188" "jacksboro.pgm 277281")
has_size() { [[ -f $1 && $(stat -c %s "$1") -eq $2 ]]; }

complete=true
for map in "${maps[@]}"; do
  read -r name size <<<"$map"
  has_size "$folder/$name" "$size" || complete=false
done
if $complete; then exit 0; fi

# Inside the target folder, so that the final mv is a rename.
work=$(mktemp -d "$folder/.fetch.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
# As root apt would drop to the user _apt, who may not write here, and warn about it.
download() { apt-get -qq -o APT::Sandbox::User="$(id -un)" download efl-doc python-matplotlib-data; }
download 2>/dev/null || { apt-get update -qq && download; }  # a machine that never read the package lists
for package in ./*.deb; do dpkg -x "$package" unpacked; done

images=unpacked/usr/share/doc/efl-doc/examples/evas/resources/images
cp "$images/rocks_NM_height.tga" "$images/four_NM_height.tga" .

# elevation.npy: a header of 80 bytes, then 344 rows of 403 little-endian int16, none of them negative. PGM is big-endian.
unzip -p unpacked/usr/share/matplotlib/mpl-data/sample_data/jacksboro_fault_dem.npz elevation.npy >heights.npy
if ! head -c 80 heights.npy | grep -aqF "{'descr': '<i2', 'fortran_order': False, 'shape': (344, 403), }"; then
  echo "$0: jacksboro_fault_dem.npz does not hold 344x403 int16 heights as expected" >&2
  exit 1
fi
{
  printf 'P5\n403 344\n65535\n'
  tail -c +81 heights.npy | dd conv=swab status=none
} >jacksboro.pgm

for map in "${maps[@]}"; do
  read -r name size <<<"$map"
  if ! has_size "$name" "$size"; then
    echo "$0: $name has $(stat -c %s "$name") bytes, not $size as expected" >&2
    exit 1
  fi
  chmod 644 "$name"
  mv -f "$name" "$folder/$name"
done
