#!/bin/sh
# The trainings of other libraries in docs/comparisons.md: default and tuned settings, tasks 1, 2 and 4, seeds 0 to 4.
# Takes hours. Finished ones are not repeated.
#
#     sh python/benchmarks/peers.sh FOLDER
set -eu
out=$1
peers=$(dirname "$0")/peers.py
# One thread each.
export XLA_FLAGS="--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1" OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

train() { # SETTINGS ALGORITHM [OPTION...]
    settings=$1 algorithm=$2
    shift 2
    for seed in 0 1 2 3 4; do
        for task in task1 task2 task4; do
            table=$out/$settings/$task-$algorithm-seed$seed.csv
            # A head and ten rows.
            [ -f "$table" ] && [ "$(wc -l <"$table")" -eq 11 ] && continue
            python "$peers" $task "$algorithm" --seed $seed --steps 10000 --start-noise 0.01 --out "$out/$settings" "$@"
        done
    done
}

small='policy_kwargs={"net_arch":[128,128]}'
for algorithm in sbx-td3 sbx-sac sb3-ppo; do
    train default $algorithm
done
train tuned sbx-td3 --set "$small" --set batch_size=128 --set learning_rate=0.001 --set learning_starts=2000
train tuned sbx-sac --set "$small" --set batch_size=128 --set learning_rate=0.001 --set ent_coef=0.02
train tuned sbx-crossq --set "$small" --set batch_size=128 --set learning_rate=0.001 --set ent_coef=0.02
train tuned sb3-td3 --set "$small" --set batch_size=128 --set learning_rate=0.001 --set learning_starts=2000
train tuned sb3-sac --set "$small" --set batch_size=128 --set learning_rate=0.001 --set ent_coef=0.02
train tuned sb3-ppo --set n_steps=256 --set learning_rate=0.001 --set ent_coef=0.01
