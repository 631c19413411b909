#!/usr/bin/env bash
# manual.sh PROGRAM VERSION FOLDER: compressed manual pages of the program and its commands.
set -euo pipefail
program=$1 version=$2 folder=$3
rm -rf "$folder"
mkdir -p "$folder"

cat >"$folder/ensonify.more" <<'END'
[FILES]
.TP
/usr/share/doc/ensonify/examples
Scenes and recipes of the Debian package. Begin with
.B ensonify run /usr/share/doc/ensonify/examples/ripples.toml
END

# page NAME COMMAND...: what it is comes from the first sentence of its --help.
page() {
  local name=$1 what
  shift
  what=$("$@" --help | sed '/^Usage:/,$d' | tr '\n' ' ' | sed -E 's/^ensonify: //;s/ \([^)]*\)//g;s/([.:;] |[.:;] *$).*//;s/ +$//')
  help2man --no-info --version-string="$version" --name="$what" --opt-include="$folder/$name.more" "$*" |
    sed -E -e "s/^\.TH [^\"]*/.TH ${name^^} /" -e "s/^${name/-/ } \\\\-/$name \\\\-/" |
    gzip -9n >"$folder/$name.1.gz"
}
page ensonify "$program"
"$program" --help | sed -nE '/^Subcommands:/,$s/^  ([a-z][a-z-]+).*/\1/p' | while read -r command; do
  page "ensonify-$command" "$program" "$command"
done
rm "$folder/ensonify.more"
