#pragma once

namespace ensonify::engine::app {

/// Keeps up to 64 MB that was freed for the next arrays: the system clears what it gives anew. For
/// the start of the program.
void keep_freed_memory();

}  // namespace ensonify::engine::app
