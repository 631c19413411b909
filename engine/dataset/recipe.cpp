#include <ensonify/engine/dataset/recipe.h>

#include <algorithm>
#include <array>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/base/random.h>
#include <ensonify/engine/dataset/piece_sizes.h>
#include <ensonify/engine/dataset/recipe_text.h>
#include <ensonify/engine/scene/checks/check.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/seafloor/bed/survey.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {
namespace {

bool any_matches(const auto& values, const std::string& pattern) {
  return std::ranges::any_of(values, [&](const auto& value) { return matches(value, pattern); });
}

/// Calls f with each held-out value and the name of the set that it is in.
void for_each_held_out(const SplitOptions& split, const auto& f) {
  for (const std::string& value : split.held_out_val) f(value, "held_out_val");
  for (const std::string& value : split.held_out_test) f(value, "held_out_test");
}

/// train, val or test for a group of samples that stay together: the samples with the same `values`
/// of the keys of the split, or, if `counted`, those of the seafloor with this number.
std::string split_of(std::uint64_t seed, const SplitOptions& split,
                     const std::vector<std::string>& values, std::uint64_t number, bool counted) {
  const auto has_one_of = [&](const std::vector<std::string>& held_out) {
    return std::ranges::any_of(held_out,
                               [&](const auto& pattern) { return any_matches(values, pattern); });
  };
  if (has_one_of(split.held_out_test)) return "test";
  if (has_one_of(split.held_out_val)) return "val";
  // A set with held-out values has only samples with these values.
  const double val = split.held_out_val.empty() ? split.val : 0.0;
  const double test = split.held_out_test.empty() ? split.test : 0.0;
  const RandomStream stream(seed, Purpose::dataset_split, {counted ? 0 : number, 0, 0});
  std::array<double, 1> u{};
  // Counted groups have stratified numbers, so that the sets' shares are close to the given ones.
  if (counted)
    u[0] = stratified(stream, number);
  else
    stream.uniform(u);
  const double at = u[0] * (split.train + val + test);
  return at < test ? "test" : at < test + val ? "val" : "train";
}

/// The name of a key without the absent tables: the tables after them have lower numbers.
std::string renumbered(const std::string& key, const auto& lists, const auto& absent) {
  for (const auto& [list, size] : lists) {
    if (!key.starts_with(list + ".")) continue;
    const std::size_t dot = key.find('.', list.size() + 1);
    if (dot == std::string::npos) return key;
    const std::size_t number = std::stoul(key.substr(list.size() + 1, dot - list.size() - 1));
    std::size_t now = number;
    for (std::size_t i = 0; i < number; ++i) now -= absent.contains(fmt::format("{}.{}", list, i));
    return fmt::format("{}.{}{}", list, now, key.substr(dot));
  }
  return key;
}

/// Returns make(sample) for the first sample for which it does not throw, because some draws may
/// make no valid scene. Throws the SceneError of the last try.
auto first_that_is(std::size_t samples, const auto& make) {
  constexpr std::size_t tries = 16;
  for (std::size_t sample = 0;; ++sample) try {
      return make(sample);
    } catch (const SceneError&) {
      if (sample + 1 >= std::min(tries, samples)) throw;
    }
}

/// Throws SceneError if a key has, or can be drawn with, a value other than `allowed` (as in TOML).
/// `places` are the places of keys in the text.
void allow_only(const RecipeText& text, const auto& places, const std::string& key,
                std::string_view allowed, std::string_view why) {
  std::vector<std::string> values;
  std::string place;
  if (const auto plain = text.values.find(key); plain != text.values.end()) {
    values.push_back(plain->second);
    place = places.at(key);
  }
  if (const auto drawn = text.distributions.find(key); drawn != text.distributions.end()) {
    drawn->second.collect_values(values);
    place = drawn->second.place;
  }
  for (const std::string& value : values)
    if (value != allowed)
      throw SceneError(fmt::format("{}: '{}' is {}, but {}", place, key, value, why));
}

/// Sets a key that the recipe's text may not have.
void add_override(const std::string& key, const std::string& value, DrawnValues& values) {
  values.values[key].clear();  // else a wrong value would be reported at a line of the text
  if (!value.empty()) values.overrides.push_back(key + "=" + value);
}

/// Throws SceneError if the dataset has options of lines, and all sonars make frames.
void check_frames(const DatasetOptions& options, const Scene& scene) {
  if (!std::ranges::all_of(scene.sonars, &Sonar::steers)) return;
  for (const auto& [asked, key] : {std::pair(options.tiles.any(), "dataset.tiles"),
                                   {options.chips.any(), "dataset.chips"},
                                   {options.ground_px_m > 0.0, "dataset.ground_px_m"},
                                   {!options.slant, "dataset.slant"}})
    if (asked)
      throw SceneError(
          fmt::format("'{}' cannot be used with imaging sonars, whose frames are labelled whole: "
                      "leave it out",
                      key));
}

/// Checks that the dataset's options fit each other; refuse(message) makes the exception.
void check_options(const DatasetOptions& options, const auto& refuse) {
  if (options.seafloors > options.samples)
    throw refuse(
        "'dataset.seafloors' is more than 'dataset.samples', expected at most that number");
  const TileOptions& tiles = options.tiles;
  if ((tiles.width_px > 0) != (tiles.height_px > 0) ||
      (tiles.width_m > 0.0) != (tiles.height_m > 0.0) ||
      (tiles.width_px > 0 && tiles.width_m > 0.0))
    throw refuse("'dataset.tiles' expects width_px and height_px, or width_m and height_m");
  const ChipOptions& chips = options.chips;
  if (chips.size_m > 0.0 && !chips.margin.empty())
    throw refuse("'dataset.chips' expects size_m or margin, not both");
  if (chips.margin.size() > 2 || (chips.margin.size() == 2 && chips.margin[0] > chips.margin[1]))
    throw refuse("'dataset.chips.margin' expects a number, [0.2], or [least, most]");
  if (chips.backgrounds + chips.hard_negatives > 0 && !chips.any())
    throw refuse("'dataset.chips' expects a size_px, size_m or margin");
  if (!options.slant && options.ground_px_m == 0.0 && (tiles.any() || chips.any()))
    throw refuse(
        "with 'dataset.slant' = false there are no images to cut tiles or chips from: set "
        "'dataset.ground_px_m', or leave 'slant' out");
  const SplitOptions& split = options.split;
  if (!(split.train + split.val + split.test > 0.0))
    throw refuse("'dataset.split': expected a share of more than 0");
  if (split.by.empty())
    throw refuse("'dataset.split.by' is empty, expected seafloor, or keys of the recipe");
  const bool by_keys =
      std::ranges::any_of(split.by, [](const auto& key) { return key != "seafloor"; });
  if (!by_keys && !(split.held_out_val.empty() && split.held_out_test.empty()))
    throw refuse("'dataset.split' has held_out values, expected by = the key that has them");
  for (const std::string& val : split.held_out_val)
    for (const std::string& test : split.held_out_test)
      if (matches(val, test) || matches(test, val))
        throw refuse(
            fmt::format("'dataset.split' has {} in held_out_val and {} in held_out_test, "
                        "expected each value in one of them",
                        toml_string(val), toml_string(test)));
}

/// Throws refuse(message) for a held-out value that no key of the split can have. Does nothing if a
/// key can have values that the text does not list; Recipe::warnings() checks the draws.
void check_held_out(const RecipeText& text, const SplitOptions& split, const auto& refuse) {
  std::vector<std::string> keys, values;
  for (const std::string& key : split.by) {
    if (key == "seafloor") continue;
    keys.push_back(key);
    const auto plain = text.values.find(key);
    const auto drawn = text.distributions.find(key);
    if (plain != text.values.end())
      values.push_back(plain->second);
    else if (drawn != text.distributions.end() && drawn->second.gives_only_words())
      drawn->second.collect_values(values);
    else
      return;
  }
  std::set<std::string> possible;
  for (const std::string& value : values) possible.insert(plain_text(value));
  for_each_held_out(split, [&](const std::string& value, std::string_view set) {
    if (!any_matches(possible, value))
      throw refuse(fmt::format(
          "'dataset.split.{}' names {}, which no value of {} matches; expected some of {}", set,
          toml_string(value), fmt::join(keys, " or "), fmt::join(possible, ", ")));
  });
}

/// Collects the keys that are drawn once per seafloor: the keys of the seabed, the keys of the
/// split, and the keys on which these depend.
void collect_keys_of_seafloor(DrawnKeys& keys, const SplitOptions& split) {
  std::vector<std::string> open;
  for (const auto& [key, distribution] : keys.distributions)
    if (in_table(key, "seafloor") || in_table(key, "objects") || in_table(key, "material"))
      open.push_back(key);
  for (const std::string& key : split.by)
    if (key != "seafloor") open.push_back(key);
  while (!open.empty()) {
    const std::string key = std::move(open.back());
    open.pop_back();
    if (!keys.of_seafloor.insert(key).second) continue;
    if (const auto found = keys.distributions.find(key); found != keys.distributions.end())
      for (std::string& needed : found->second.needs()) open.push_back(std::move(needed));
  }
}

bool in_absent(const std::string& key, const auto& absent) {
  return std::ranges::any_of(absent,
                             [&](const std::string& table) { return in_table(key, table); });
}

bool is_presence(const std::string& key) { return key.ends_with(".present"); }

/// Whether a key can leave its table out of a sample.
bool decides_presence(const std::string& key) {
  return is_presence(key) || (in_table(key, "objects") && key.ends_with(".count"));
}

/// Adds to `absent` the tables of objects whose drawn count is 0. (In a scene, a count of 0 is one
/// object at its given place; a drawn count is the number of objects.) All tables of an assembly
/// have the count of its base.
void leave_out_none(SampleDraws& draws, const DrawnKeys& d, const std::string& name,
                    std::set<std::string, std::less<>>& absent) {
  const auto objects = d.lists.find("objects");
  if (objects == d.lists.end()) return;
  std::map<std::string, bool> left_out;  // by the names of assemblies
  for (std::size_t i = 0; i < objects->second; ++i) {
    const std::string table = fmt::format("objects.{}", i), of = table + ".assembly";
    if (absent.contains(table)) continue;
    const auto is_none = [&] {
      return d.distributions.contains(table + ".count") &&
             draws.value(table + ".count", name) == "0";
    };
    const bool has_assembly = d.distributions.contains(of) || d.values.contains(of);
    const std::string assembly = has_assembly ? plain_text(draws.value(of, name)) : "";
    if (assembly.empty() ? is_none() : left_out.try_emplace(assembly, is_none()).first->second)
      absent.insert(table);
  }
}

/// The values with which a recipe becomes the scene of a sample. `name` is the recipe's name.
DrawnValues values_of(SampleDraws& draws, const DrawnKeys& d, const std::string& name,
                      std::size_t sample) {
  DrawnValues values;
  for (const auto& [list, size] : d.lists)
    for (std::size_t i = 0; i < size; ++i) {
      const std::string table = fmt::format("{}.{}", list, i), key = table + ".present";
      if (!d.distributions.contains(key) && !d.values.contains(key)) continue;
      const std::string& present = draws.value(key, name);
      if (present != "true" && present != "false")
        throw SceneError(fmt::format("{}: sample {}: '{}' is {}, expected true or false", name,
                                     sample, key, present));
      if (present == "false") values.absent.insert(table);
    }
  leave_out_none(draws, d, name, values.absent);
  for (const auto& [key, distribution] : d.distributions) {
    if (in_absent(key, values.absent)) continue;
    const std::string& value = draws.value(key, name);
    if (!is_presence(key)) values.values[renumbered(key, d.lists, values.absent)] = value;
    if (d.overridden.contains(key))
      add_override(renumbered(key, d.lists, values.absent), value, values);
  }
  return values;
}

/// The values of the keys of 'dataset.split.by'.
std::vector<std::string> values_of_split(SampleDraws& draws, const SplitOptions& split,
                                         const std::string& name) {
  std::vector<std::string> values;
  for (const std::string& key : split.by)
    if (key != "seafloor")
      values.push_back(plain_text(draws.value(key, name + ": 'dataset.split.by'")));
  return values;
}

/// The split of a sample. Samples with equal keys of 'dataset.split.by' share it.
std::string split_of_sample(SampleDraws& draws, const DrawnKeys& d, const SplitOptions& split,
                            const std::string& name, std::size_t seafloor) {
  const bool by_seafloor = std::ranges::count(split.by, "seafloor") > 0;
  const std::vector<std::string> group = values_of_split(draws, split, name);
  // With "seafloor" the other keys need no number: they are drawn once per seafloor, too.
  const std::uint64_t group_number =
      by_seafloor ? seafloor : key_number(fmt::format("{}", fmt::join(group, "\n")));
  return split_of(d.seed, split, group, group_number, by_seafloor);
}

}  // namespace

Recipe::Recipe(const std::filesystem::path& file, const std::filesystem::path& data_folder,
               std::vector<std::string> overrides)
    : Recipe(read_scene_text(file), file.string(), data_folder, std::move(overrides)) {}
Recipe::Recipe(Recipe&&) noexcept = default;
Recipe::~Recipe() = default;

Recipe::Recipe(std::string text, std::string name, const std::filesystem::path& data_folder,
               std::vector<std::string> overrides)
    : text_(std::move(text)),
      name_(std::move(name)),
      overrides_(std::move(overrides)),
      data_folder_(data_folder),
      options_(parse_dataset_options(text_, name_, overrides_)),
      drawn_keys_(std::make_unique<DrawnKeys>()) {
  DrawnKeys& d = *drawn_keys_;
  static_cast<RecipeText&>(d) = parse_recipe_text(text_, name_, data_folder_, overrides_);
  const auto refuse = [&](std::string_view message) {
    return SceneError(fmt::format("{}: {}{}", name_, message, with_overrides(overrides_)));
  };
  check_options(options_, refuse);
  check_held_out(d, options_.split, refuse);
  d.renders = static_cast<std::size_t>(options_.renders);
  collect_keys_of_seafloor(d, options_.split);
  Scene scene = with_every_table();
  if (!scene.output.class_names.empty() || !scene.output.sediment_names.empty())
    throw refuse(
        "'output.class_names' and 'output.sediment_names' are set by the dataset itself: leave "
        "them out");
  allow_only(
      d, scene.places, "display.slant_range_correction", "false",
      "a dataset's labels are made in slant range: leave it out; 'dataset.ground_px_m' makes "
      "images and labels in ground range");
  allow_only(d, scene.places, "display.speed_correction", "false",
             "a dataset's labels have a pixel for each sample: leave it out");
  allow_only(d, scene.places, "output.png_bits", "8",
             "a dataset's pictures have 8 bits: leave it out; 'output.npz' writes the samples");
  for (const auto& [key, off] :
       {std::pair{"output.pings_per_file", "0"}, std::pair{"output.file_per_leg", "false"}})
    allow_only(d, scene.places, key, off,
               "a sample has one part: leave it out; 'dataset.tiles' cuts images into pieces");
  for_each_file(scene, [&](const std::string& key, const InputFile& file) {
    for (const std::string& name : possible_values(d, key, file.name))
      if (!name.empty()) files_.insert(name);
  });
  auto [targets, grounds, materials] = possible_names(d, scene, paths());
  for (const std::string& chosen : options_.chips.classes)
    if (!targets.contains(chosen))
      throw refuse(
          fmt::format("'dataset.chips.classes' names {}, which no target is; expected some of {}",
                      toml_string(chosen), fmt::join(targets, ", ")));
  for (const std::set<std::string>* names : {&targets, &grounds})
    if (names->contains(std::string(name_of_number_0)))
      throw refuse(
          fmt::format("a class can be \"{}\", which is the name of number 0: give it another name",
                      name_of_number_0));
  targets_.assign(targets.begin(), targets.end());
  if (options_.shadow_class) {
    if (targets.contains(std::string(shadow_name)) || grounds.contains(std::string(shadow_name)))
      throw refuse("'dataset.shadow_class' adds the class shadow, which the recipe has already");
    targets_.emplace_back(shadow_name);
  }
  grounds_.assign(grounds.begin(), grounds.end());
  materials_.assign(materials.begin(), materials.end());
  if (targets_.size() + grounds_.size() > 254 || materials_.size() > 254)
    throw refuse(
        "labels can have more than 254 names, which masks of 8 bits cannot hold: use fewer");
  first_that_is(samples(), [&](std::size_t number) { return sample(number); });
}

Scene Recipe::with_every_table() const {
  return first_that_is(samples(), [&](std::size_t sample) {
    DrawnValues whole;
    SampleDraws draws(*drawn_keys_, sample, seafloor_of(sample), 0);
    for (const auto& [key, distribution] : drawn_keys_->distributions)
      if (!is_presence(key)) whole.values[key] = draws.value(key, name_);
    for (const std::string& key : drawn_keys_->overridden)
      add_override(key, whole.values.at(key), whole);
    // Unchecked: this scene has all optional tables at once, and they may contradict each other.
    return parse_recipe_unchecked(text_, name_, whole);
  });
}

ScenePaths Recipe::paths() const { return scene_paths(name_, data_folder_); }

std::size_t Recipe::seafloors() const {
  return options_.seafloors > 0 ? static_cast<std::size_t>(options_.seafloors) : samples();
}

SampleScene Recipe::sample(std::size_t number) const {
  const DrawnKeys& d = *drawn_keys_;
  SampleScene result;
  result.seafloor = seafloor_of(number);
  const auto scene_of = [&](std::size_t render) {
    SampleDraws draws(d, number, result.seafloor, render);
    const DrawnValues values = values_of(draws, d, name_, number);
    if (render == 0) {
      for (const auto& [key, distribution] : d.distributions)
        if (decides_presence(key) || !in_absent(key, values.absent))
          result.drawn[key] = draws.value(key, name_);
      result.split = split_of_sample(draws, d, options_.split, name_, result.seafloor);
    }
    try {
      return parse_recipe(text_, name_, values, paths());
    } catch (const SceneError& error) {
      throw SceneError(fmt::format("{} (sample {})", error.what(), number));
    }
  };

  result.scene = scene_of(0);
  result.scene.output.class_names = class_names();
  result.scene.output.sediment_names = material_names();
  if (std::ranges::any_of(result.scene.sonars, &Sonar::steers))
    result.scene.output.fans = false;  // frames/ has them, with their labels
  result.renders = {result.scene.display};
  for (int render = 1; render < options_.renders; ++render)
    result.renders.push_back(scene_of(static_cast<std::size_t>(render)).display);
  const auto seed = [&](std::string_view what, std::size_t of) {
    std::array<double, 1> u{};
    RandomStream(d.seed, Purpose::recipe, {key_number(what), of, 0}).uniform(u);
    return static_cast<std::uint64_t>(u[0] * 0x1p53) - 1;
  };
  result.scene.seed = seed("seed", number);
  if (!d.has_seafloor_seed && !d.distributions.contains("seafloor.seed"))
    result.scene.seafloor_seed = seed("seafloor.seed", result.seafloor);
  try {
    check_frames(options_, result.scene);
    require_lines_for_pieces(options_, result.scene);
  } catch (const SceneError& error) {
    throw SceneError(fmt::format("{}: {}{} (sample {})", name_, error.what(),
                                 with_overrides(overrides_), number));
  }
  return result;
}

std::vector<std::string> Recipe::warnings() const {
  std::vector<std::string> warnings;
  if (!options_.slant && options_.ground_px_m == 0.0)
    warnings.emplace_back(
        "the samples have no labels and no images for the indexes, because dataset.slant is "
        "false: set dataset.ground_px_m, or leave slant out");
  const SplitOptions& split = options_.split;
  if (split.held_out_val.empty() && split.held_out_test.empty()) return warnings;
  std::set<std::string> drawn;
  for (std::size_t seafloor = 0; seafloor < seafloors(); ++seafloor) try {
      // The keys of the split do not depend on the sample.
      SampleDraws draws(*drawn_keys_, 0, seafloor, 0);
      for (std::string& value : values_of_split(draws, split, name_))
        drawn.insert(std::move(value));
    } catch (const SceneError&) {  // sample() refuses the samples of this seafloor
    }
  for_each_held_out(split, [&](const std::string& value, std::string_view set) {
    if (!any_matches(drawn, value))
      warnings.push_back(
          fmt::format("dataset.split.{} names {}, which no sample has: correct it, or use more "
                      "seafloors or another seed",
                      set, toml_string(value)));
  });
  return warnings;
}

std::vector<std::string> Recipe::class_names() const {
  std::vector<std::string> names = targets_;
  names.insert(names.end(), grounds_.begin(), grounds_.end());
  return names;
}
std::vector<std::string> Recipe::assets() const {
  std::set<std::string> assets = files_;
  for (const std::string& name : files_) {
    const std::filesystem::path file = std::filesystem::absolute(path_of(name)).lexically_normal();
    const std::string its_folder = name.substr(0, name.size() - file.filename().string().size());
    for (const std::filesystem::path& behind : files_behind(file))
      assets.insert(its_folder + behind.lexically_relative(file.parent_path()).string());
  }
  return {assets.begin(), assets.end()};
}
std::filesystem::path Recipe::path_of(const std::string& asset) const {
  const ScenePaths all = paths();
  return asset.starts_with(data_prefix) ? all.data_folder / asset.substr(data_prefix.size())
                                        : all.scene_folder / asset;
}

}  // namespace ensonify::engine
