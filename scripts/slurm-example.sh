#!/usr/bin/env bash
# A batch job for Slurm that goes on by itself until the run is done. Copy it, change the lines marked, and: sbatch FILE
#
# Two minutes before the time limit Slurm sends SIGUSR1 to the ranks. The run finishes its step, writes a checkpoint and
# ends with exit code 4; the job then puts itself back into the queue, and starts from the checkpoint next time. After a
# node's failure (--requeue) it goes on from the last checkpoint that is whole. docs/restart.md says what is promised.

#SBATCH --job-name=cairn
#SBATCH --nodes=2               # change
#SBATCH --ntasks-per-node=64    # change: one rank for each core
#SBATCH --time=04:00:00         # change
#SBATCH --signal=USR1@120       # to the ranks, 120 s before the end; more where a checkpoint takes longer to write
#SBATCH --requeue
#SBATCH --open-mode=append

set -u
CAIRN=$HOME/cairn/build/release/bin/cairn # change
CASE=case.toml                            # change
OUT=results/case                          # change

restart=()
if compgen -G "$OUT/checkpoint_*.h5" >/dev/null; then
  restart=(--restart latest)
elif compgen -G "$OUT/history.csv" >/dev/null; then
  restart=(--overwrite) # it ended before its first checkpoint
fi

srun "$CAIRN" run "$CASE" --out "$OUT" "${restart[@]}" --set 'output.checkpoint={ interval_wall = 1800, keep = 2 }'
code=$?
if [[ $code -eq 4 ]]; then
  scontrol requeue "$SLURM_JOB_ID"
fi
exit "$code"
