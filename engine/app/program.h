#pragma once

namespace ensonify::engine::app {

// Each source that includes this header has its own constant. Developers need no warning.
#if defined(__OPTIMIZE__) || defined(ENSONIFY_DEVELOPER)
constexpr bool compiled_with_optimisation = true;
#else
constexpr bool compiled_with_optimisation = false;
#endif

/// The program `ensonify`: carries out the command line that main() gets, and returns the exit
/// code. Data goes to stdout, everything else to stderr. It ignores the signals SIGXFSZ and
/// SIGPIPE. During a command it handles SIGINT, SIGTERM, SIGHUP, SIGXCPU, SIGUSR1 and SIGUSR2. It
/// may be called once. Your program may call it, too: it then has all commands, and the
/// intersectors of program_intersector_kinds() (trace/intersector.h). If `optimised` is false, it
/// warns that the program may be slow. By default `optimised` is true if the caller is compiled
/// with optimisation.
int program_main(int argc, char** argv, bool optimised = compiled_with_optimisation);

}  // namespace ensonify::engine::app
