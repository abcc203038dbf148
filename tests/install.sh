#!/usr/bin/env bash
# Runs every command of README's section "Install" in a clean copy of what is committed, with a home and a
# Python of its own, and looks at what it has installed. Where docker is absent, the commands of the
# Dockerfile run in the copy instead, but those that install packages of the system.
#
#     tests/install.sh
#
# Packages come from the registries; SEAMWISE_INSTALL keeps what is built in a folder for the next run.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scratch=$(mktemp -d)
readonly scratch
trap 'rm -rf "$scratch"' EXIT
mkdir "$scratch/copy" "$scratch/home"
git archive HEAD | tar -x -C "$scratch/copy"
# A repository of its own, so that what is made in it counts for no part of it.
git -C "$scratch/copy" init -q
git -C "$scratch/copy" add -A
git -C "$scratch/copy" -c user.name=install -c user.email=install@localhost commit -qm copy

# Of the user's home only what Rust has.
export CARGO_HOME=${CARGO_HOME:-$HOME/.cargo} RUSTUP_HOME=${RUSTUP_HOME:-$HOME/.rustup}
export CARGO_INSTALL_ROOT=$scratch/home/.cargo HOME=$scratch/home
export CARGO_TARGET_DIR=${SEAMWISE_INSTALL:-$scratch/target}
python3 -m venv "$HOME/python"
export PATH=$HOME/python/bin:$CARGO_INSTALL_ROOT/bin:$PATH
cd "$scratch/copy"

run() {
  local start=$SECONDS
  printf '\n$ %s\n' "$1"
  bash -euo pipefail -c "$1" </dev/null
  printf '  took %d s\n' $((SECONDS - start))
}

# What the image would run, with its folders below the home.
run_dockerfile() {
  local line root=$HOME/image
  grep '^RUN ' Dockerfile | grep -v apt-get | while read -r line; do
    line=${line#RUN }
    run "${line//\/opt\/seamwise/$root}"
  done
  [[ -s $root/share/man/man1/seamwise-bake.1 && -s $root/share/bash-completion/completions/seamwise ]]
  run "$root/bin/seamwise --version"
}

commands=$(sed -n '/^## Install$/,/^## Run it$/s/^    //p' README.md)
while IFS= read -r command; do
  if [[ $command == docker* ]] && ! docker info >/dev/null 2>&1; then
    printf '\nskipped: no docker: %s\n' "$command"
    [[ $command == "docker build"* ]] && run_dockerfile
    continue
  fi
  run "$command"
done <<<"$commands"

for made in .local/share/man/man1/seamwise.1 .local/share/man/man1/seamwise-bake.1 \
  .local/share/bash-completion/completions/seamwise .cargo/bin/seamwise; do
  [[ -s $HOME/$made ]] || { echo "$made was not installed"; exit 1; }
done
# The sample is in the program: nothing of the copy is needed.
(cd "$HOME" && run "seamwise bake --sample --fast --no-evaluate --levels 1 -o out")
# Figures of the package are the tool's, to the bit.
run "pip install --quiet trimesh pillow"
run "python3 python/examples/scan.py data/sample.glb quarter.glb >figures.json"
run "seamwise evaluate data/sample.glb quarter.glb --json told.json"
run "python3 -c 'import json; own, told = (json.load(open(f)) for f in (\"figures.json\", \"told.json\")); assert own == told[\"candidates\"][0][\"metrics\"]; print(len(own), \"figures are equal\")'"
printf 'use seamwise::bake_bytes;\nfn main() { let _ = bake_bytes; }\n' >../levels/src/main.rs
run "cargo check --quiet --manifest-path ../levels/Cargo.toml"
run "python3 -c 'import zipfile; print(*zipfile.ZipFile(\"seamwise_blender.zip\").namelist())'"
run "cd page && node -e 'import(\"seamwise-three\").then((own) => console.log(Object.keys(own)))'"
# Each crate builds from what would be published of it.
run "cargo package --workspace --exclude seamwise-python"
printf '\nevery command of README.md has run\n'
