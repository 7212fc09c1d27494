#!/usr/bin/env bash
# @COUNT@ independent jobs; submit with: sbatch THIS_FILE
# Before its time limit, a job saves its work and is put into the queue again, where it continues. Others that were
# interrupted continue when the script is submitted again.
#SBATCH --job-name=mge-@NAME@
#SBATCH --array=0-@LAST@
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --output=mge-@NAME@-%A_%a.log
#SBATCH --open-mode=append
#SBATCH --requeue
#SBATCH --signal=B:USR1@120
set -euo pipefail
command=$(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" <<'END_OF_PLAN'
@PLAN@END_OF_PLAN
)
eval "$command --threads 1 &"
program=$!
# A signal that the shell passes on ends its wait: it waits until none does.
pass() { passed=yes; kill -s "$1" "$program" || true; }
trap 'pass USR1' USR1
trap 'pass TERM' TERM
passed=yes
while [ "$passed" ]; do passed='' status=0; wait "$program" || status=$?; done
# Ended by SIGUSR1, which is signal 10, with its work saved.
[ "$status" != 138 ] || scontrol requeue "$SLURM_JOB_ID"
exit "$status"
