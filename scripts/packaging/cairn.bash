# Completion of `cairn` for bash; installed where bash-completion looks for it, or: source scripts/packaging/cairn.bash
# shellcheck shell=bash

_cairn() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]} words=""
  if ((COMP_CWORD == 1)); then
    mapfile -t COMPREPLY < <(compgen -W "run check info pack init keys plot measure view report export compare-runs convert-grains convert-labels convert-cells --help --version" -- "$word")
    return
  fi
  case $before in
    --set)
      mapfile -t COMPREPLY < <(compgen -W "$(cairn keys 2>/dev/null | tr -s ', ' '\n' | grep -F .)" -S = -- "$word")
      compopt -o nospace
      return ;;
    --restart) mapfile -t COMPREPLY < <(compgen -W latest -- "$word") ;;
  esac
  case $command in
    run) words="--out --set --restart --allow-changes --overwrite --profile --explain --help" ;;
    check) words="--set --help" ;;
    pack) words="-o --help" ;;
    measure) words="--at --every -o --table --only --box --threshold --rattlers --radius --cell --across --bins --by-points --help" ;;
    plot) words="--compare --film --raw-stress --fringes --times --colour --range --clip --azimuth --elevation --zoom --perspective --size --help" ;;
    view) words="--out --values --size --help" ;;
    report) words="--out --pdf --help" ;;
    export) words="--out --form --times --help" ;;
    *) words="--help" ;;
  esac
  if [[ $word == -* ]]; then mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word"); fi
}
complete -o default -F _cairn cairn
