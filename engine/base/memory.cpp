#include <ensonify/engine/base/memory.h>

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>

#include <fmt/format.h>

namespace ensonify::engine {
namespace {

namespace fs = std::filesystem;

constexpr double infinite = std::numeric_limits<double>::infinity();

/// The number after `name` in a file of names and numbers, such as /proc/meminfo; 0 if missing.
double number_in(const fs::path& file, std::string_view name) {
  std::ifstream in(file);
  for (std::string word; in >> word;)
    if (double value = 0.0; word == name && in >> value) return value;
  return 0.0;
}

/// The only number in a file; none if the file has a word instead ("max") or does not exist.
std::optional<double> number_of(const fs::path& file) {
  std::ifstream in(file);
  double value = 0.0;
  return in >> value ? std::optional(value) : std::nullopt;
}

double available_in_machine_bytes() {
  const fs::path file = "/proc/meminfo";  // in KiB
  const double available = number_in(file, "MemAvailable:");
  return available > 0.0 ? 1024.0 * (available + number_in(file, "SwapFree:")) : infinite;
}

/// The free memory of the control group `group` or of one of its parents, whichever has least.
/// Cached pages of files count as used there but can be freed, so they are added.
double available_in_group_bytes(const fs::path& root, fs::path group, const char* limit,
                                const char* used, const char* prefix) {
  double least = infinite;
  for (group = (root / group.relative_path()).lexically_normal();; group = group.parent_path()) {
    const std::optional<double> bytes = number_of(group / limit), taken = number_of(group / used);
    if (bytes && taken) {
      const fs::path statistics = group / "memory.stat";
      const std::string cached = fmt::format("{}active_file", prefix),
                        idle = fmt::format("{}inactive_file", prefix);
      least = std::min(
          least, *bytes - *taken + number_in(statistics, cached) + number_in(statistics, idle));
    }
    if (group == root || !group.has_relative_path()) return least;
  }
}

double available_in_groups_bytes() {
  double least = infinite;
  std::ifstream in("/proc/self/cgroup");
  for (std::string line; std::getline(in, line);) {  // number:controllers:path
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const fs::path path = line.substr(second + 1);
    if (controllers.empty())
      least = std::min(least, available_in_group_bytes("/sys/fs/cgroup", path, "memory.max",
                                                       "memory.current", ""));
    else if (controllers == "memory")
      least = std::min(
          least, available_in_group_bytes("/sys/fs/cgroup/memory", path, "memory.limit_in_bytes",
                                          "memory.usage_in_bytes", "total_"));
  }
  return least;
}

/// Pages of this process: all that are mapped, those in memory, and those of files in memory.
struct Pages {
  double mapped = 0.0, resident = 0.0, of_files = 0.0;
};
Pages own_pages() {
  Pages own;
  std::ifstream("/proc/self/statm") >> own.mapped >> own.resident >> own.of_files;
  return own;
}

double page_bytes() { return static_cast<double>(sysconf(_SC_PAGESIZE)); }

double available_addresses_bytes() {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return infinite;
  return static_cast<double>(limit.rlim_cur) - page_bytes() * own_pages().mapped;
}

std::string in_words(double bytes) {
  return bytes < 1e9 ? fmt::format("{:.0f} MB", 1e-6 * bytes)
                     : fmt::format("{:.1f} GB", 1e-9 * bytes);
}

}  // namespace

double available_memory_bytes() {
  return std::max(0.0, std::min({available_in_machine_bytes(), available_in_groups_bytes(),
                                 available_addresses_bytes()}));
}

void MemoryLimit::require(double more_bytes, std::string_view what, std::string_view remedy) const {
  const Pages own = own_pages();
  const double used = page_bytes() * (own.resident - own.of_files);
  const double left = bytes > 0.0 ? bytes - used : available_memory_bytes();
  if (more_bytes <= left) return;
  throw MemoryError(fmt::format(
      "{} need about {} of memory, but {}; {}", what, in_words(more_bytes),
      bytes > 0.0
          ? fmt::format("--memory allows {}, of which {} are used", in_words(bytes), in_words(used))
          : fmt::format("{} are available (--memory sets another limit)", in_words(left)),
      remedy));
}

void throw_out_of_memory(std::string_view what) {
  throw MemoryError(
      fmt::format("out of memory while making {}, with {} available; use larger cells, a smaller "
                  "area or fewer threads",
                  what, in_words(available_memory_bytes())));
}

}  // namespace ensonify::engine
