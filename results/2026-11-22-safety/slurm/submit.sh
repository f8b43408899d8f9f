#!/bin/bash
# Sends the 4 parts, and the merge behind them. `submit.sh 3,7` sends parts 3 and 7 again.
set -euo pipefail

cd "$(dirname "$0")"
mkdir -p /tmp/scratch/cluster/logs
parts=$(sbatch --parsable ${1:+--array="$1"} part.sbatch)
merge=$(sbatch --parsable --dependency=afterok:"$parts" merge.sbatch)
echo "parts: job $parts, merge: job $merge, logs:" /tmp/scratch/cluster/logs
