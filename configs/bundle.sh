#!/usr/bin/env bash
# Packs what a machine without our packages needs to run the binary: bundle.sh BINARY FOLDER
# Leaves FOLDER/reliefbench-VERSION-COMMIT-x86_64.tar.zst and prints its path; the same inputs give the same bytes.
# Needs Debian's dpkg, binutils, patchelf, zstd, and what `./dev setup` fetches.
set -euo pipefail

if [[ $# -ne 2 ]]; then
  echo "usage: $0 BINARY FOLDER" >&2
  exit 2
fi
here=$(cd "$(dirname "$0")" && pwd)
binary=$(realpath "$1")
mkdir -p "$2"
folder=$(realpath "$2")

newest_glibc=2.36
most_bytes=$((40 << 20))

# Of the system, always: glibc, and the loaders of OpenGL, EGL and Vulkan.
not_ours='^(ld-linux.*|lib(c|m|mvec|dl|pthread|rt|util|resolv|anl)|lib(GL|GLX|EGL|OpenGL|GLdispatch|vulkan))\.so'
# Of the system, where it has them: what a driver uses too, in versions that may be newer than ours. A process has one
# of each, and with ours Mesa on Debian 13 is no device.
of_driver='^lib(stdc\+\+|gcc_s|z|zstd|lzma|X11|xcb|Xau|Xdmcp|bsd|md)\.so'
# What is linked statically, or as a header or script.
built_in=(glslang-dev libcli11-dev libeigen3-dev libjs-chart.js libvulkan-volk-dev nlohmann-json3-dev spirv-tools)

fail() {
  echo "$0: $*" >&2
  exit 1
}

work=$(mktemp -d "$folder/.bundle.XXXXXX")
trap 'rm -rf "$work"' EXIT

version=$("$binary" --version)  # reliefbench 0.1.0 (0123456789ab)
name=${version//[()]/}
name=${name// /-}-x86_64
mkdir -p "$work/$name"/{bin,lib/fallback,licences}
cd "$work/$name"

# Libraries: what the binary needs, and what those need in turn.
needs=$(ldd "$binary")
if grep 'not found' <<<"$needs" >&2; then fail "$binary lacks libraries"; fi
libraries=()
while read -r library; do
  file=${library##*/}
  if [[ $file =~ $not_ours ]]; then continue; fi
  if [[ $file =~ $of_driver ]]; then to=lib/fallback; else to=lib; fi
  cp "$library" "$to/$file"
  libraries+=("$(realpath "$library")")
done < <(awk '$2 == "=>" { print $3 }' <<<"$needs")
# Packages name their files with /usr/lib or with /lib, which are one folder.
owners=$({ dpkg -S "${libraries[@]}" "${libraries[@]#/usr}" || true; } 2>/dev/null)
[[ $(wc -l <<<"$owners") -eq ${#libraries[@]} ]] || fail "a library is of no package, so that its licence is not known"
for package in $(cut -d : -f 1 <<<"$owners" | sort -u) "${built_in[@]}"; do
  cp "/usr/share/doc/$package/copyright" "licences/$package"
done
strip -o bin/reliefbench "$binary"

# Found beside the binary. $LIB is the system's word for its own folder: lib64, lib/x86_64-linux-gnu, ...
# As RUNPATH, so that LD_LIBRARY_PATH chooses a driver as ever; it does not hold for a library's own libraries, so that
# each has one. A library that needs no other of ours has none: libepoxy looks for the driver where the system says.
ours=$(find lib -name '*.so*' -printf '%f\n')
# shellcheck disable=SC2016
patchelf --set-rpath '$ORIGIN/../lib:/usr/$LIB:$ORIGIN/../lib/fallback' bin/reliefbench
for library in lib/*.so* lib/fallback/*; do
  patchelf --print-needed "$library" | grep -qxF "$ours" || continue
  # shellcheck disable=SC2016
  if [[ $library = lib/fallback/* ]]; then path='/usr/$LIB:$ORIGIN'; else path='$ORIGIN:/usr/$LIB:$ORIGIN/fallback'; fi
  patchelf --set-rpath "$path" "$library"
done

needed=$(objdump -T bin/* lib/*.so* lib/fallback/* | grep -oE 'GLIBC_([0-9.]+|PRIVATE)' | sort -uV | tail -n 1)
[[ $(printf '%s\n' "$needed" "GLIBC_$newest_glibc" | sort -V | tail -n 1) = "GLIBC_$newest_glibc" ]] ||
  fail "needs $needed, more than glibc $newest_glibc has"

mkdir configs heightmaps
cp -r "$here"/*.json "$here"/*/ configs/
cp "$here"/../build/heightmaps/*.tga "$here"/../build/heightmaps/*.pgm heightmaps/ || fail "no heightmaps: run ./dev setup"
cp -r "$here"/../build/naga naga || fail "no naga: run ./dev setup"
cat >README <<TEXT
$version: for x86-64 Linux with glibc $newest_glibc or later and a driver

  bin/reliefbench devices --audit
  bin/reliefbench sweep configs/quickstart.json -o out/quickstart --backend all
  bin/reliefbench report out/quickstart -o out/quickstart/report.html

Besides its driver, Vulkan needs libvulkan.so.1, OpenGL libEGL.so.1 and libOpenGL.so.0 (or libGL.so.1). Where one of the
two is missing, the other runs. This folder may lie anywhere.

lib/ has the libraries that the binary needs. Those in lib/fallback a driver may need, too, in newer versions, so that
they are used only where /usr/lib64 (or what this system calls it) has none. LD_LIBRARY_PATH goes before both.

licences/ has the licence of each package that is within; the heightmaps' are in \`bin/reliefbench list heightmaps\`.
TEXT

cd "$work"
find "$name" -type d -exec chmod 755 {} +
find "$name" -type f -exec chmod 644 {} +
chmod 755 "$name/bin/reliefbench"
tar --create --sort=name --format=gnu --mtime=@0 --owner=0 --group=0 --numeric-owner "$name" |
  zstd -q -10 --single-thread -o "$name.tar.zst"
bytes=$(stat -c %s "$name.tar.zst")
[[ $bytes -lt $most_bytes ]] || fail "$name.tar.zst has $bytes bytes, more than 40 MiB"
mv -f "$name.tar.zst" "$folder/"
echo "$folder/$name.tar.zst"
