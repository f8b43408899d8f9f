#!/bin/sh
# All measurements on a hardware GPU, in some four minutes:
#     benches/gpu.sh PROGRAM DEVICE OUT        PROGRAM: a release build; DEVICE: its `cargo bench --no-run --bench device`
# With JAX=PYTHON JAX solves taps on the same GPU. Each step has its own log in OUT and does not stop the next.
program=$1 device=$2 out=$3
here=$(dirname "$0")
mkdir -p "$out"
work=$(mktemp -d)
step() {
    name=$1 limit=$2
    shift 2
    begun=$(date +%s)
    timeout "$limit" "$@" >"$out/$name.txt" 2>&1
    echo "$name: exit code $?, $(($(date +%s) - begun)) s"
}
ranked() {
    name=$1
    shift
    step "$name" 150 python3 "$here/ranked.py" "$work" "$@"
    mv "$work/ranked.csv" "$out/$name.csv"
}
step devices 30 "$program" devices
# The first process compiles shaders into the driver's cache.
for backend in gpu gpu cpu auto; do
    step "first_$backend" 60 sh -c "time '$program' sweep sweeps/prototypes.toml --backend $backend --quiet --force --out '$work/first'"
done
step device 60 "$device" --bench
export JAX_PLATFORMS=cuda ROUNDS=2
ONLY=ideal,practical,practical_200,practical_gridded,practical_gridded_total,practical_large,practical_gridded_large \
    ranked ranked "cpu=$program --backend cpu" "gpu=$program --backend gpu"
unset JAX
ONLY=practical_solved,friction_solved \
    ranked solved "cpu=$program --backend cpu --precision f64" "gpu=$program --backend gpu --precision f64"
step verify 60 "$program" verify sweeps/practical.toml --samples 20000 --backend gpu --out "$work/verify" --force
rm -rf "$work"
