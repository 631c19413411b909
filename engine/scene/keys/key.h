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
               ExrCompression, Conditions>;
/// The option behind a key, to be set.
using Option = OptionTypes::Pointer;
/// The same, to be read.
using ConstOption = OptionTypes::ConstPointer;

/// Where an owner has the option of a key.
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

/// The option at the end of a chain of members, for a row of the key table.
template <class Part, class Owner, class... Rest>
auto at(Part Owner::*first, Rest... rest) {
  return [=](auto& owner) -> auto& { return ((owner.*first).*....*rest); };
}

/// Allowed values, in the key's own unit, the ends among them.
struct Range {
  double low = 0.0;
  double high = 0.0;
};

/// The largest seed: TOML's largest integer.
inline constexpr auto largest_seed = static_cast<double>(std::numeric_limits<std::int64_t>::max());

/// A row of the key table. The unit of a number is in its name; degrees (_deg) are kept as radians.
template <class Owner>
struct Key {
  std::string_view name;
  std::string_view unit;  ///< "" for what has none
  Range range;            ///< of numbers
  std::string_view help;
  OptionAt<Owner> option;
  /// The words allowed; those of an enumeration in its order. A scene may write - for _ in them.
  std::vector<std::string_view> choices;
  std::string_view expected = {};  ///< what it accepts, if type and range do not define that

  bool in_degrees() const { return name.ends_with("_deg"); }
};

/// A TOML table: its dotted name ("" for the top of the file), and its keys.
template <class Owner>
struct Section {
  std::string_view name;
  std::string_view help;
  std::vector<Key<Owner>> keys;
};

}  // namespace ensonify::engine
