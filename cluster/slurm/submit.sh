#!/bin/bash
# Sends the @SHARDS@ parts, and the merge behind them. `submit.sh 3,7` sends parts 3 and 7 again.
set -euo pipefail

cd "$(dirname "$0")"
mkdir -p @LOGS@
parts=$(sbatch --parsable ${1:+--array="$1"} part.sbatch)
merge=$(sbatch --parsable --dependency=afterok:"$parts" merge.sbatch)
echo "parts: job $parts, merge: job $merge, logs:" @LOGS@
