#!/bin/bash
# Sends the @SHARDS@ parts, and the merge behind them. `submit.sh 3,7` sends parts 3 and 7 again.
set -euo pipefail

case $0 in */*) CDPATH='' cd -- "${0%/*}/" ;; esac
mkdir -p logs
parts=$(sbatch --parsable ${1:+--array="$1"} part.sbatch)
behind=afterok:${parts%%;*}
if ! merge=$(sbatch --parsable --dependency="$behind" merge.sbatch); then
    echo "the parts were sent (job $parts), the merge was not. In $PWD: sbatch --dependency=$behind merge.sbatch sends it," \
        "scancel ${parts%%;*} takes the parts back" >&2
    exit 1
fi
echo "parts: job $parts, merge: job $merge, logs: $PWD/logs"
