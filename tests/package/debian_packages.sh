#!/usr/bin/env bash
# The Debian packages hold what a user needs, and their program, manual and completion work from
# where dpkg unpacks them.
set -euo pipefail
build_folder=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for tool in help2man dpkg-deb; do
  command -v "$tool" >/dev/null || { echo "skipped: no $tool here"; exit 77; }
done

cpack --config "$build_folder/CPackConfig.cmake" -G DEB -B "$work" >"$work/log" 2>&1 ||
  { cat "$work/log"; exit 1; }
for package in "$work"/*.deb; do dpkg-deb -x "$package" "$work/root"; done
usr=$work/root/usr
for file in bin/ensonify include/ensonify/engine/simulate.h share/doc/ensonify/copyright \
  share/doc/libensonify-dev/changelog.gz share/doc/ensonify/CHANGELOG.md share/doc/ensonify/examples/ripples.toml \
  share/doc/ensonify/examples/slurm/generate.sbatch; do
  [[ -s $usr/$file ]] || { echo "no $file in the packages"; exit 1; }
done
# The program uses FFTW, whose licence is the GPL.
for package in ensonify libensonify-dev; do
  grep -q '^License: GPL-3+$' "$usr/share/doc/$package/copyright" ||
    { echo "the copyright file of $package does not state the licence of the program"; exit 1; }
done

commands=$("$usr/bin/ensonify" --help | sed -nE '/^Subcommands:/,$s/^  ([a-z][a-z-]+).*/\1/p')
for command in $commands; do
  zcat "$usr/share/man/man1/ensonify-$command.1.gz" | grep -q "^ensonify-$command .. " ||
    { echo "the manual has no page of $command"; exit 1; }
done

# complete_words WORD...: what the completion offers for the last word.
complete_words() {
  PATH=$usr/bin:$PATH bash -c '
    source "$1/share/bash-completion/completions/ensonify"
    shift
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
    _ensonify
    echo "${COMPREPLY[*]}"' bash "$usr" "$@"
}
[[ $(complete_words ensonify ge) == generate ]]
[[ " $(complete_words ensonify run --) " == *" --surface "*" --json "* ]]
[[ $(complete_words ensonify run scenes/) == "" ]]  # left to bash: files

if command -v lintian >/dev/null; then
  lintian --fail-on error,warning --allow-root "$work"/*.deb
fi
