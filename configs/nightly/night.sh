#!/usr/bin/env bash
# One night of performance tracking, for cron, systemd and CI: measures, and mails or comments when something moved.
#   RELIEFBENCH_DB    the history: a file, or postgresql://...        (default: nightly.sqlite)
#   RELIEFBENCH_NEWS  a command that takes the news on its standard input (default: cat)
# Ends with the exit code of `track night`: 0 nothing open, 1 a regression is open, 2 to 5 as everywhere.
set -uo pipefail
cd "$(dirname "$0")/../.."
db=${RELIEFBENCH_DB:-nightly.sqlite}
commit=$(git rev-parse HEAD 2>/dev/null) parent=$(git rev-parse HEAD^ 2>/dev/null)

build/release/reliefbench track night configs/nightly.json --db "$db" --page trend.html --quiet \
  ${commit:+--commit "$commit"} ${parent:+--parent "$parent"} --markdown >night.md
code=$?
if grep -q ', new:' night.md; then ${RELIEFBENCH_NEWS:-cat} <night.md; fi
exit $code
