#include <ensonify/engine/app/program.h>

int main(int argc, char** argv) { return ensonify::engine::app::program_main(argc, argv); }
