#!/usr/bin/env bash
# Fetches naga, wgpu's shader translator as WebAssembly, from the npm registry: fetch_naga.sh FOLDER
# `export` writes WGSL with it. Needs curl, tar and sha256sum.
set -euo pipefail

package=naga-wasm version=30.1.0
archive_sha256=2a32fa9c47ace94109b8ad3359911fd54573664770ab557f70c322d16f9fde58

if [[ $# -ne 1 ]]; then
  echo "usage: $0 FOLDER" >&2
  exit 2
fi
mkdir -p "$(dirname "$1")"
parent=$(cd "$(dirname "$1")" && pwd)
folder=$parent/$(basename "$1")
if grep -qsF "\"version\": \"$version\"" "$folder/package.json"; then exit 0; fi

# Inside the target's parent, so that the final mv is a rename.
work=$(mktemp -d "$parent/.fetch.XXXXXX")
trap 'rm -rf "$work"' EXIT
cd "$work"
archive=$package-$version.tgz
curl -fsSLO "https://registry.npmjs.org/$package/-/$archive"
if ! sha256sum --check --status <<<"$archive_sha256  $archive"; then
  echo "$0: $archive is not the archive that was expected" >&2
  exit 1
fi
tar -xzf "$archive"
rm -rf "$folder"
mv package "$folder"
