#!/bin/sh
# Everything that is measured on a hardware GPU, in some five minutes:
#     benches/gpu.sh PROGRAM EFFECTS OUT        PROGRAM: a release build; EFFECTS: its `cargo bench --no-run --bench effects`
# JAX=PYTHON has JAX solve the same taps on the same GPU. Each step has its own log in OUT and does not stop the next.
program=$1 effects=$2 out=$3
here=$(dirname "$0")
mkdir -p "$out"
step() {
    name=$1 limit=$2
    shift 2
    begun=$(date +%s)
    timeout "$limit" "$@" >"$out/$name.txt" 2>&1
    echo "$name: exit code $?, $(($(date +%s) - begun)) s"
}
work=$(mktemp -d)
step devices 30 "$program" devices
# The first process compiles what later ones find in the driver's cache.
for n in 1 2 3; do
    step "first_$n" 60 sh -c "time '$program' sweep sweeps/prototypes.toml --backend gpu --out '$work/gpu' --force"
done
step first_cpu 60 sh -c "time '$program' sweep sweeps/prototypes.toml --backend cpu --out '$work/cpu' --force"
step verify 120 "$program" verify --backend gpu --out "$out/verify" --force
TAPS=1048576 step effects 120 "$effects" --bench
JAX_PLATFORMS=cuda ONLY=ideal,practical,friction,practical_200,practical_gridded,practical_gridded_total \
    step ranked 150 python3 "$here/ranked.py" "$out" "cpu=$program --backend cpu" "gpu=$program --backend gpu"
mv "$out/ranked.csv" "$out/ranked_small.csv"
ROUNDS=1 ONLY=practical_large,practical_gridded_large JAX= \
    step large 100 python3 "$here/ranked.py" "$out" "cpu=$program --backend cpu" "gpu=$program --backend gpu"
mv "$out/ranked.csv" "$out/ranked_large.csv"
rm -rf "$work" "$out"/*.toml
