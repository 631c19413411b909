#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <ensonify/engine/scene/scene.h>

namespace ensonify::engine {

/// The types of value that a key can have.
template <class... Value>
struct ValueTypes {
  using Pointer = std::variant<Value*...>;
  using ConstPointer = std::variant<const Value*...>;
};
using OptionTypes =
    ValueTypes<bool, int, std::uint64_t, std::optional<std::uint64_t>, double,
               std::optional<double>, std::string, std::vector<std::string>, std::vector<double>,
               InputFile, std::vector<Eigen::Vector2d>, RefractionMode, SeafloorKind,
               FractalSpectrum, TrackKind, Vertical, Sides, Palette, Mapping, DisplayedLayer,
               ColumnValue, PulseKind, PulseWindow, ShadingKind, Detector, TransferCurve,
               ExrCompression, Conditions, SonarKind, BeamSteps>;
/// A pointer to the option of a key, to set the option.
using Option = OptionTypes::Pointer;
/// A pointer to the option of a key, to read the option.
using ConstOption = OptionTypes::ConstPointer;

/// Finds the option of a key in its owner.
template <class Owner>
class OptionAt {
 public:
  /// member(owner) is a reference to the option.
  template <class Member>
  OptionAt(Member member)
      : set_([=](Owner& owner) -> Option { return &member(owner); }),
        get_([=](const Owner& owner) -> ConstOption { return &member(owner); }) {}
  /// The option of a part of the owner.
  template <class Part>
  OptionAt(const OptionAt<Part>& option, Part Owner::*part)
      : set_([=](Owner& owner) { return option(owner.*part); }),
        get_([=](const Owner& owner) { return option(owner.*part); }) {}
  Option operator()(Owner& owner) const { return set_(owner); }
  ConstOption operator()(const Owner& owner) const { return get_(owner); }

 private:
  std::function<Option(Owner&)> set_;
  std::function<ConstOption(const Owner&)> get_;
};

/// For a row of the key table: finds the option at the end of a chain of members.
template <class Part, class Owner, class... Rest>
auto at(Part Owner::*first, Rest... rest) {
  return [=](auto& owner) -> auto& { return ((owner.*first).*....*rest); };
}

/// The names of kinds, as the words of a key.
template <class Kinds>
std::vector<std::string_view> words_of(const Kinds& kinds) {
  std::vector<std::string_view> words;
  for (const auto& kind : kinds) words.push_back(kind.name);
  return words;
}

/// The range of allowed values in the unit of the key, including both ends.
struct Range {
  double low = 0.0;
  double high = 0.0;
};

/// The largest seed: TOML's largest integer.
inline constexpr auto largest_seed = static_cast<double>(std::numeric_limits<std::int64_t>::max());

/// A row of the key table. The name of a number ends with its unit. Degrees are stored as radians.
template <class Owner>
struct Key {
  std::string_view name;
  std::string_view unit;  ///< "" for a key without a unit
  Range range;            ///< of numbers
  std::string_view help;
  OptionAt<Owner> option;
  /// The allowed words; for an enumeration, in the order of its enumerators. A scene may write -
  /// for _.
  std::vector<std::string_view> choices;
  std::string_view expected = {};  ///< what the key accepts, if type and range do not show this

  bool in_degrees() const { return name.ends_with("_deg"); }
};

/// A TOML table: its dotted name, which is "" for the top of the file, and its keys.
template <class Owner>
struct Section {
  std::string_view name;
  std::string_view help;
  std::vector<Key<Owner>> keys;
};

}  // namespace ensonify::engine
