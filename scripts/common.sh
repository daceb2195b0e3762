# Shared by the scripts of this folder: source it, do not run it.
# shellcheck shell=bash

# The repository's top folder.
# shellcheck disable=SC2034  # used by the scripts
CAIRN_ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# die MESSAGE...: one line to standard error, then out.
die() {
  printf '%s: %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# Number of cores this process may use.
core_count() { nproc 2>/dev/null || getconf _NPROCESSORS_ONLN; }

# absolute PATH: seen from the folder where the script was called.
absolute() { [[ $1 == /* ]] && printf '%s' "$1" || printf '%s' "$PWD/$1"; }

# print_help FILE: the comment at the top of a script, as its help text.
print_help() { sed -n '2,/^[^#]/{s/^# \{0,1\}//p}' "$1"; }

# set_mpirun RANKS: fills the array MPIRUN with the launcher and its options. What Open MPI needs beside them is said
# in its variables, so that any MPI's mpirun serves.
set_mpirun() {
  local ranks=$1
  MPIRUN=(mpirun -n "$ranks")
  if [[ $(id -u) -eq 0 ]]; then # Open MPI refuses root unless told twice; containers run as root
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    export OMPI_MCA_btl_vader_single_copy_mechanism=none # which containers forbid, with a warning for each message
  fi
  if ((ranks > $(core_count))); then # Open MPI refuses that, too; ranks that share a core must give way to each other
    export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1
  fi
}
