#!/usr/bin/env bash
# Fetches the known heightmaps (kernels/image/heightmap.cpp) from Debian packages: fetch_heightmaps.sh FOLDER
# The packages are unpacked, not installed: slim systems drop /usr/share/doc. Needs apt, dpkg, unzip, coreutils, awk.
set -euo pipefail

if [[ $# -ne 1 ]]; then
  echo "usage: $0 FOLDER" >&2
  exit 2
fi
mkdir -p "$1"
folder=$(cd "$1" && pwd)

# Name and size in bytes; a file of another size is fetched anew.
declare -A size=([rocks_NM_height.tga]=262188 [four_NM_height.tga]=262188 [jacksboro.pgm]=277281
  [bathymetry.pgm]=65536 [arena.png]=18487 [island.png]=9091)
has_size() { [[ -f $1 && $(stat -c %s "$1") -eq ${size[$(basename "$1")]} ]]; }
has_all() {
  local name
  for name; do has_size "$folder/$name" || return 1; done
}

# Inside the target folder, so that the final mv is a rename.
work=$(mktemp -d "$folder/.fetch.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
# As root apt would drop to the user _apt, who may not write here, and warn about it.
download() { apt-get -qq -o APT::Sandbox::User="$(id -un)" download "$1"; }
unpacked() { # PACKAGE: makes its files stand in ./PACKAGE
  download "$1" 2>/dev/null || { apt-get update -qq && download "$1"; } || return 1 # on a machine without package lists
  dpkg -x "$1"_*.deb "$1"
}
member() { # NPZ ARRAY HEADER: the array's data, behind a header of HEADER bytes that must say what is expected
  unzip -p "python-matplotlib-data/usr/share/matplotlib/mpl-data/sample_data/$1.npz" "$2.npy" >array.npy
  head -c "$3" array.npy | grep -aqF "$4" || {
    echo "$0: $1.npz does not hold $4 as expected" >&2
    exit 1
  }
  tail -c "+$(($3 + 1))" array.npy
}
keep() {
  local name
  for name; do
    if ! has_size "$name"; then
      echo "$0: $name has $(stat -c %s "$name") bytes, not ${size[$name]} as expected" >&2
      exit 1
    fi
    chmod 644 "$name"
    mv -f "$name" "$folder/$name"
  done
}

if ! has_all rocks_NM_height.tga four_NM_height.tga; then
  unpacked efl-doc
  images=efl-doc/usr/share/doc/efl-doc/examples/evas/resources/images
  cp "$images/rocks_NM_height.tga" "$images/four_NM_height.tga" .
  keep rocks_NM_height.tga four_NM_height.tga
fi

if ! has_all jacksboro.pgm bathymetry.pgm; then
  unpacked python-matplotlib-data
  # 344 rows of 403 little-endian int16, none of them negative. PGM is big-endian.
  {
    printf 'P5\n403 344\n65535\n'
    member jacksboro_fault_dem elevation 80 "{'descr': '<i2', 'fortran_order': False, 'shape': (344, 403), }" |
      dd conv=swab status=none
  } >jacksboro.pgm
  # 91 rows of 120 little-endian floats, in metres from -9,000 to 7,000.
  {
    printf 'P2\n120 91\n65535\n'
    member topobathy topo 128 "{'descr': '<f4', 'fortran_order': False, 'shape': (91, 120), }" |
      od -An -v -w480 -t f4 | LC_ALL=C awk '{ for (i = 1; i <= NF; ++i) printf "%05d%s", $i + 20000.5, i < NF ? " " : "\n" }'
  } >bathymetry.pgm
  keep jacksboro.pgm bathymetry.pgm
fi

# Some are only compared on: what runs without them goes on.
if ! has_all arena.png island.png; then
  if unpacked colobot-common; then
    levels=colobot-common/usr/share/games/colobot/levels
    cp "$levels/battles/relief.png" arena.png
    cp "$levels/plus/chapter006/level002/relief.png" island.png
    keep arena.png island.png
  else
    echo "$0: colobot-common cannot be fetched: no heightmaps arena and island" >&2
  fi
fi
