#pragma once

#include <ensonify/engine/scene/schema.h>

namespace ensonify::engine {

/// For the key tables: the option at the end of a chain of members.
template <class Owner, class... Rest>
auto at(auto Owner::*first, Rest... rest) {
  return [=](Owner& owner) -> Option { return &((owner.*first).*....*rest); };
}

}  // namespace ensonify::engine
