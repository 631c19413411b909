#include <ensonify/engine/image/label_names.h>

#include <algorithm>

namespace ensonify::engine {
namespace {

/// Finds a name; index 0 is not searched, because "none" is not a name.
auto place_of(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin() + 1, names.end(), name);
}

void renumber(const std::vector<std::string>& from, const std::vector<std::string>& to,
              std::vector<std::uint32_t>& layer) {
  if (from == to) return;
  const std::vector<std::uint32_t> numbers = new_numbers(from, to);
  for (std::uint32_t& label : layer) label = numbers.at(label);
}

}  // namespace

std::vector<std::string> joined_names(const std::vector<std::string>& own,
                                      std::span<const std::string> wanted) {
  std::vector<std::string> all{own.front()};
  all.insert(all.end(), wanted.begin(), wanted.end());
  for (std::size_t i = 1; i < own.size(); ++i)
    if (place_of(all, own[i]) == all.end()) all.push_back(own[i]);
  return all;
}

std::vector<std::uint32_t> new_numbers(const std::vector<std::string>& from,
                                       const std::vector<std::string>& to) {
  std::vector<std::uint32_t> numbers{0};
  for (std::size_t i = 1; i < from.size(); ++i)
    numbers.push_back(static_cast<std::uint32_t>(place_of(to, from[i]) - to.begin()));
  return numbers;
}

LabelNames renumber(const LabelNames& own, const LabelNames& wanted, std::span<Waterfall> images) {
  LabelNames names{joined_names(own.classes, wanted.classes),
                   joined_names(own.materials, wanted.materials)};
  for (Waterfall& image : images) {
    renumber(own.classes, names.classes, image.pixels.class_id);
    renumber(own.materials, names.materials, image.pixels.sediment);
  }
  return names;
}

}  // namespace ensonify::engine
