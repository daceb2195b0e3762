#pragma once
/// How much memory there is.

namespace cairn {

/// What the system can give without swapping, and what the limits of control groups (containers, Slurm) leave [bytes];
/// infinite where it does not say.
double available_memory();

/// What this process may use: the lowest of its limits (ulimit -v, ulimit -m) [bytes]; infinite where there is none.
double memory_limit();

/// Ranks of this program on this machine, as the launcher says; 1 where it does not.
int ranks_on_machine();

}  // namespace cairn
