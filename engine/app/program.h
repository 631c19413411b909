#pragma once

namespace ensonify::engine::app {

/// The program `ensonify`: carries out its command line, of main()'s arguments, and returns the
/// exit code. Data goes to stdout, everything else to stderr. It ignores the signals SIGXFSZ and
/// SIGPIPE and, during a command, handles SIGINT, SIGTERM, SIGHUP, SIGXCPU, SIGUSR1 and SIGUSR2. To
/// be called once. A program of your own that calls it has all commands, with the intersectors of
/// program_intersector_kinds() (trace/intersector.h).
int program_main(int argc, char** argv);

}  // namespace ensonify::engine::app
