#!/bin/bash
# Sends the @SHARDS@ parts, and the merge behind them. `submit.sh 3,7` sends parts 3 and 7 again.
set -euo pipefail

case $0 in */*) CDPATH='' cd -- "${0%/*}/" ;; esac
mkdir -p logs
parts=$(sbatch --parsable ${1:+--array="$1"} part.sbatch)
merge=$(sbatch --parsable --dependency=afterok:"${parts%%;*}" merge.sbatch)
echo "parts: job $parts, merge: job $merge, logs: $PWD/logs"
