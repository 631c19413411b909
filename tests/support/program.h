#pragma once

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "support/files.h"
#include "support/paths.h"
#include "support/temporary_folder.h"

namespace ensonify::tests {

/// The result of running a program.
struct Outcome {
  int code = -1;  ///< the exit code, or minus the signal that ended it
  std::string out, err;
};

/// A line of /proc/PID/status, such as "VmRSS:", in MB, about every 20 ms until the process ends.
inline std::vector<double> memory_mb(pid_t process, const std::string& line) {
  const std::filesystem::path status =
      std::filesystem::path("/proc") / std::to_string(process) / "status";
  std::vector<double> memory;
  for (;;) {
    const std::string text = read_text(status);
    const std::size_t at = text.find(line);
    if (at == std::string::npos) return memory;
    memory.push_back(std::stod(text.substr(at + line.size())) / 1024.0);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

/// The largest value of each quarter of a series.
inline std::array<double, 4> largest_of_quarters(const std::vector<double>& values) {
  std::array<double, 4> largest{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    double& one = largest[4 * i / values.size()];
    one = std::max(one, values[i]);
  }
  return largest;
}

/// Runs the program in a folder and waits for it. `environment` is added to this process's, and a
/// separate cache unless it sets one; `meanwhile` is called with the process id once it runs;
/// stdout may be redirected, and stdin may come from a file (otherwise it is empty).
inline Outcome run_program(const std::filesystem::path& folder, std::vector<std::string> arguments,
                           const std::vector<std::string>& environment = {},
                           const std::function<void(pid_t)>& meanwhile = {},
                           std::filesystem::path stdout_file = {},
                           const std::filesystem::path& stdin_file = "/dev/null") {
  const TemporaryFolder streams;
  const std::filesystem::path err = streams / "err";
  if (stdout_file.empty()) stdout_file = streams / "out";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, stdin_file.c_str(), O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, stdout_file.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());

  arguments.insert(arguments.begin(), program_file().string());
  std::vector<char*> argv, envp;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  std::vector<std::string> own = environment;
  own.push_back("ENSONIFY_CACHE=" +
                (streams / "cache").string());  // the first of equal names counts
  for (std::string& variable : own) envp.push_back(variable.data());
  for (char** variable = environ; *variable; ++variable) {
    const std::string name = std::string(*variable).substr(0, std::string(*variable).find('=') + 1);
    if (name != "ENSONIFY_DATA=" && name != "ENSONIFY_CACHE=") envp.push_back(*variable);
  }
  envp.push_back(nullptr);

  // Under nohup this process, and so its children, would ignore it.
  sigset_t hang_up;
  sigemptyset(&hang_up);
  sigaddset(&hang_up, SIGHUP);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setsigdefault(&attributes, &hang_up);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF);
  pid_t process = 0;
  const int error = posix_spawn(&process, argv[0], &actions, &attributes, argv.data(), envp.data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("the program cannot be started");
  if (meanwhile) meanwhile(process);
  int status = 0;
  waitpid(process, &status, 0);
  return {.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status),
          .out = read_text(streams / "out"),
          .err = read_text(err)};
}

}  // namespace ensonify::tests
