// The program `cairn` of a portable build: starts the one that was compiled for the highest level of x86-64 that this
// processor has, or the one that CAIRN_ISA names.

#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace {

struct Level {
  const char* name;
  bool here;  // the processor, and the system, have all of it
};

std::array<Level, 3> levels() {
  __builtin_cpu_init();
#define CAIRN_HAS(feature) (__builtin_cpu_supports(feature) != 0)
  const bool v2 = CAIRN_HAS("sse4.2") && CAIRN_HAS("ssse3") && CAIRN_HAS("popcnt");
  const bool v3 = v2 && CAIRN_HAS("avx2") && CAIRN_HAS("bmi") && CAIRN_HAS("bmi2") && CAIRN_HAS("fma");
  const bool v4 = v3 && CAIRN_HAS("avx512f") && CAIRN_HAS("avx512bw") && CAIRN_HAS("avx512cd") &&
                  CAIRN_HAS("avx512dq") && CAIRN_HAS("avx512vl");
#undef CAIRN_HAS
  return {{{"x86-64-v4", v4}, {"x86-64-v3", v3}, {"x86-64-v2", v2}}};
}

int refuse(const std::string& text) {
  std::fputs(("cairn: " + text + "\n").c_str(), stderr);
  return 2;
}

}  // namespace

int main(int, char** argv) {
  namespace fs = std::filesystem;
  const char* wanted = std::getenv("CAIRN_ISA");
  const bool given = wanted != nullptr && *wanted != '\0';
  std::error_code status;
  const fs::path programs = fs::read_symlink("/proc/self/exe", status).parent_path() / "../libexec/cairn";
  std::string names;
  for (const Level& level : levels()) {
    const fs::path program = programs / (std::string("cairn-") + level.name);
    if (!fs::exists(program, status)) continue;
    names += (names.empty() ? "" : ", ") + std::string(level.name);
    if (given && level.name != std::string(wanted)) continue;
    if (!level.here && given) return refuse(std::string("CAIRN_ISA=") + wanted + ": this processor does not have it");
    if (!level.here) continue;
    execv(program.c_str(), argv);
    return refuse(program.string() + " cannot be started");
  }
  if (names.empty()) return refuse("there is no cairn-x86-64-* in " + programs.string());
  if (given) return refuse("CAIRN_ISA must be one of " + names);
  return refuse("this processor has none of " + names + "; build with CAIRN_NATIVE=ON on it");
}
