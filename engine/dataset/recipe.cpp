#include <ensonify/engine/dataset/recipe.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <ensonify/engine/dataset/distribution.h>
#include <ensonify/engine/dataset/recipe_reader.h>
#include <ensonify/engine/number_in.h>
#include <ensonify/engine/output/manifest.h>
#include <ensonify/engine/random.h>
#include <ensonify/engine/scene/keys/key_text.h>
#include <ensonify/engine/scene/keys/schema.h>
#include <ensonify/engine/scene/reader.h>
#include <ensonify/engine/scene/scene_paths.h>
#include <ensonify/engine/seafloor/analysis.h>
#include <ensonify/engine/seafloor/objects/objects.h>
#include <ensonify/engine/seafloor/seafloor.h>

namespace ensonify::engine {
namespace {

std::uint64_t key_number(std::string_view key) {
  const std::string digits = xxh128(key);
  std::uint64_t number = 0;
  std::from_chars(digits.data(), digits.data() + 16, number, 16);
  return number;
}

/// Whether the things of a list are numbered in the labels, and so are targets: objects, and
/// features of the bed.
template <class Item>
bool has_instances() {
  if constexpr (requires(Item item) { kind_of(item.relief); })
    return kind_of(Item{}.relief).has_instances();
  else
    return std::is_same_v<Item, ObjectOptions>;
}

bool under(std::string_view path, std::string_view table) {
  return path.starts_with(table) && (path.size() == table.size() || path[table.size()] == '.');
}

}  // namespace

struct DrawnKeys : RecipeText {
  std::set<std::string, std::less<>> of_seafloor;  ///< keys that are drawn once per seafloor
  std::size_t renders = 1;                         ///< per sample
};

namespace {

/// A number in (0, 1] for each index of a sequence, which the stream seeds.
double stratified(const RandomStream& stream, std::uint64_t index) {
  std::array<double, 2> seeds{};
  stream.uniform(seeds);
  const auto seed = [](double u) { return static_cast<std::uint32_t>(u * 0xffffffffp0); };
  return stratified_number(static_cast<std::uint32_t>(index), seed(seeds[0]), seed(seeds[1]));
}

/// The values of one sample.
class SampleDraws {
 public:
  SampleDraws(const DrawnKeys& text, std::size_t sample, std::size_t seafloor, std::size_t render)
      : text_(text), sample_(sample), seafloor_(seafloor), render_(render) {}

  /// A key's value as in TOML; empty: left out. `asked_by` is the place for messages.
  const std::string& value(const std::string& key, const std::string& asked_by) {
    if (const auto known = known_.find(key); known != known_.end()) {
      if (!known->second)
        throw SceneError(
            fmt::format("{}: '{}' depends on itself through other keys (circular reference)",
                        text_.distributions.find(key)->second.place, key));
      return *known->second;
    }
    if (const auto plain = text_.values.find(key); plain != text_.values.end())
      return plain->second;
    const auto found = text_.distributions.find(key);
    if (found == text_.distributions.end())
      throw SceneError(fmt::format(
          "{}: the recipe gives no value to '{}', which is needed here: add it", asked_by, key));
    known_[key] = std::nullopt;
    std::string drawn = draw(key, found->second, key);
    return *(known_[key] = std::move(drawn));
  }

 private:
  double number(const std::string& key, const Distribution& d) {
    const std::string& text = value(key, d.place);
    const std::optional number = number_in<double>(text);
    if (!number) {
      const auto distribution = text_.distributions.find(key);
      const bool overridden = distribution != text_.distributions.end() &&
                              distribution->second.place.starts_with("-D ");
      throw SceneError(fmt::format("{}: '{}' is {}, expected a number here",
                                   overridden ? distribution->second.place : d.place, key,
                                   text.empty() ? "left out" : text));
    }
    return *number;
  }

  /// A draw of a key. `stream_name` is its name, and the entries of the tables that led to d.
  std::string draw(const std::string& stream_name, const Distribution& d, const std::string& key) {
    if (d.kind == Distribution::Kind::table) {
      const std::string by = plain_text(value(d.by, d.place));
      const auto* entry = d.entry_for(by);
      if (!entry)
        throw SceneError(fmt::format("{}: the table has no entry for {} = {}, and no default",
                                     d.place, d.by, by));
      return adjusted(draw(stream_name + "." + entry->first, entry->second, key), d);
    }
    const bool bed = text_.of_seafloor.contains(key);
    const std::size_t number = bed ? seafloor_ : sample_;
    const bool each_render = under(key, "display");
    const std::size_t render = each_render ? render_ : 0;
    const RandomStream stream(text_.seed, Purpose::recipe,
                              {key_number(stream_name), number, render});
    std::array<double, 2> u{};
    stream.uniform(u);
    if (d.stratified) {
      const RandomStream seeds(text_.seed, Purpose::recipe,
                               {key_number(stream_name), ~std::uint64_t{0}, 0});
      u[0] = stratified(seeds, each_render ? number * text_.renders + render : number);
    }
    std::string drawn = d.value(u[0], u[1]);
    // The reader refuses a range in which hardly any draw lies.
    for (std::uint64_t again = 1; d.between && !within(drawn, *d.between); ++again) {
      stream.uniform(u, 2 * again);
      drawn = d.value(u[0], u[1]);
    }
    return adjusted(std::move(drawn), d);
  }

  static bool within(const std::string& text, const std::pair<double, double>& between) {
    const double number = std::stod(text);
    return number >= between.first && number <= between.second;
  }

  /// Multiplied by the keys of `times`, then added to those of `plus`.
  std::string adjusted(std::string drawn, const Distribution& d) {
    if ((d.times.empty() && d.plus.empty()) || drawn.empty()) return drawn;
    const std::optional number_drawn = number_in<double>(drawn);
    if (!number_drawn)
      throw SceneError(fmt::format("{}: {} is drawn, expected a number here", d.place, drawn));
    double result = *number_drawn;
    for (const std::string& key : d.times) result *= number(key, d);
    for (const std::string& key : d.plus) result += number(key, d);
    return value_text(d.kind == Distribution::Kind::whole ? std::round(result) : result);
  }

  const DrawnKeys& text_;
  std::size_t sample_, seafloor_, render_;
  std::map<std::string, std::optional<std::string>> known_;  // none: being drawn
};

/// train, val or test for a group that is held together: the samples with the same `values` of the
/// keys of the split, or, if `counted`, the seafloor with this number.
std::string split_of(std::uint64_t seed, const SplitOptions& split,
                     const std::vector<std::string>& values, std::uint64_t number, bool counted) {
  const auto has_one_of = [&](const std::vector<std::string>& held_out) {
    return std::ranges::any_of(values, [&](const auto& value) {
      return std::ranges::any_of(held_out,
                                 [&](const auto& pattern) { return matches(value, pattern); });
    });
  };
  if (has_one_of(split.held_out_test)) return "test";
  if (has_one_of(split.held_out_val)) return "val";
  // A set that is given by values has no others.
  const double val = split.held_out_val.empty() ? split.val : 0.0;
  const double test = split.held_out_test.empty() ? split.test : 0.0;
  const RandomStream stream(seed, Purpose::dataset_split, {counted ? 0 : number, 0, 0});
  std::array<double, 1> u{};
  // Numbered groups are stratified, so that the shares are close to those given.
  if (counted)
    u[0] = stratified(stream, number);
  else
    stream.uniform(u);
  const double at = u[0] * (split.train + val + test);
  return at < test ? "test" : at < test + val ? "val" : "train";
}

/// The name of a key after the absent tables are left out.
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

/// Refuses a key that has or may get a value other than the allowed one, as TOML has them. `places`
/// are those of the text's keys.
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

/// Sets a key in place of the recipe's text, which may not have it.
void add_override(const std::string& key, std::string value, DrawnValues& values) {
  values.values[key].clear();  // else a wrong value would be reported at a line of the text
  if (!value.empty()) values.overrides.push_back(key + "=" + value);
}

/// The value that a key has in one scene, and all that can be drawn.
std::vector<std::string> possible_values(const RecipeText& text, const std::string& key,
                                         const std::string& value) {
  std::vector<std::string> values;
  if (const auto drawn = text.distributions.find(key); drawn != text.distributions.end())
    drawn->second.collect_values(values);
  for (std::string& drawn : values) drawn = plain_text(drawn);
  values.push_back(value);
  return values;
}

/// Collects the names of all files that the samples can use. `scene` has every optional table.
void collect_files(const RecipeText& text, Scene& scene, std::set<std::string>& names) {
  for_each_file(scene, [&](const std::string& key, const InputFile& file) {
    for (const std::string& name : possible_values(text, key, file.name))
      if (!name.empty()) names.insert(name);
  });
}

/// The names of the classes and materials that the labels of objects can have. Classes of parts are
/// no targets.
void collect_object_labels(const RecipeText& text, std::span<const ObjectOptions> objects,
                           std::set<std::string>& targets, std::set<std::string>& part_classes,
                           std::set<std::string>& materials) {
  const auto possible = [&](std::size_t number, std::string_view key, const std::string& value) {
    return possible_values(text, fmt::format("objects.{}.{}", number, key), value);
  };
  const auto may_be = [&](std::size_t number, std::string_view key, std::string_view value,
                          const std::string& given) {
    const auto plain = text.values.find(fmt::format("objects.{}.{}", number, key));
    return std::ranges::count(possible(number, key, given), value) > 0 ||
           (plain != text.values.end() && plain->second == value);
  };
  const std::vector<std::size_t> bases = bases_of(objects);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    // The first object of its assembly, or the next one if that is absent.
    std::vector<std::size_t> may_be_bases;
    for (std::size_t j = bases[i]; j <= i; ++j) {
      if (bases[j] != bases[i]) continue;
      may_be_bases.push_back(j);
      if (!may_be(j, "present", "false", "true")) break;
    }
    const bool with_parts = std::ranges::any_of(may_be_bases, [&](std::size_t base) {
      return may_be(base, "part_classes", "true", objects[base].part_classes ? "true" : "false");
    });
    const bool may_be_base = std::ranges::count(may_be_bases, i) > 0;
    for (const std::string& class_name : possible(i, "class", objects[i].class_name)) {
      if (may_be_base) targets.insert(class_name);
      for (const std::string& shape : possible(i, "shape", objects[i].shape)) {
        ObjectOptions one = objects[i];
        one.shape = shape;
        one.class_name = class_name;
        one.part_classes = with_parts && may_be_base;
        try {
          for (const ObjectPart& part : parts_of(one)) {
            materials.insert(part.material);
            if (with_parts) part_classes.insert(part.class_name);
          }
        } catch (const std::invalid_argument&) {
          continue;  // no such shape: the sample that draws it is refused
        }
      }
    }
  }
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

/// The keys that are drawn once per seafloor: the seabed's, those of the split, and those that
/// these need.
void collect_keys_of_seafloor(DrawnKeys& keys, const SplitOptions& split) {
  std::vector<std::string> open;
  for (const auto& [key, distribution] : keys.distributions)
    if (under(key, "seafloor") || under(key, "objects") || under(key, "material"))
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

/// The names that labels can have: those of a sample with every table, and all that can be drawn.
struct PossibleNames {
  std::set<std::string> targets, grounds{"seabed"}, materials;
};

/// Adds the names that the files of seafloors analysed before have. Throws refine::MeshError for a
/// file that is none.
void collect_analysed_labels(const DrawnKeys& keys, const Scene& scene, const ScenePaths& paths,
                             PossibleNames& names) {
  constexpr const char* key = "seafloor.progressive";
  const std::vector<std::string> files =
      possible_values(keys, key, scene.seafloor.progressive.name);
  for (const std::string& file : std::set(files.begin(), files.end())) {
    std::filesystem::path path;
    try {
      if (!file.empty()) path = resolve(key, file, paths);
    } catch (const SceneError&) {  // no such file: the sample that draws it is refused
    }
    if (path.empty()) continue;
    const Seafloor seafloor = open_analysed(path);
    const auto add_targets = [&](const auto& things) {
      for (const auto& thing : things)
        names.targets.insert(seafloor.classes.at(thing.label.class_id));
    };
    add_targets(seafloor.objects);
    add_targets(seafloor.features);
    // Number 0 is no name. possible_names() takes the classes of targets out of the ground.
    names.grounds.insert(seafloor.classes.begin() + 1, seafloor.classes.end());
    names.materials.insert(seafloor.materials.begin() + 1, seafloor.materials.end());
  }
}

PossibleNames possible_names(const DrawnKeys& keys, Scene& scene, const ScenePaths& paths) {
  PossibleNames names;
  names.materials.insert(scene.seafloor.material);
  std::set<std::string>&targets = names.targets, &grounds = names.grounds;
  std::set<std::string>& materials = names.materials;
  std::vector<std::string_view> lists_of_targets;
  for_each_list(scene,
                [&]<class Item>(const Section<Item>& section, const std::vector<Item>& list) {
                  if (has_instances<Item>()) lists_of_targets.push_back(section.name);
                  if constexpr (!std::is_same_v<Item, ObjectOptions>)
                    for (const Item& item : list) {
                      (has_instances<Item>() ? targets : grounds).insert(item.class_name);
                      materials.insert(item.material);
                    }
                });
  for (const auto& [key, distribution] : keys.distributions) {
    std::vector<std::string> values;
    distribution.collect_values(values);
    const bool of_instances = std::ranges::any_of(
        lists_of_targets, [&whole = key](auto list) { return under(whole, list); });
    if (key.ends_with(".class") && !under(key, "objects"))
      for (const std::string& value : values)
        (of_instances ? targets : grounds).insert(plain_text(value));
    if (key.ends_with(".material"))
      for (const std::string& value : values) materials.insert(plain_text(value));
  }
  collect_object_labels(keys, scene.objects, targets, grounds, materials);
  collect_analysed_labels(keys, scene, paths, names);
  for (std::set<std::string>* all : {&targets, &grounds, &materials}) all->erase("");
  for (const std::string& target : targets) grounds.erase(target);
  return names;
}

bool in_absent(const std::string& key, const auto& absent) {
  return std::ranges::any_of(absent, [&](const std::string& table) { return under(key, table); });
}

bool is_presence(const std::string& key) { return key.ends_with(".present"); }

/// The values with which a recipe becomes the scene of a sample. `name` is the recipe's.
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
  for (const auto& [key, distribution] : d.distributions) {
    if (in_absent(key, values.absent)) continue;
    const std::string& value = draws.value(key, name);
    if (!is_presence(key)) values.values[renumbered(key, d.lists, values.absent)] = value;
    if (d.overridden.contains(key))
      add_override(renumbered(key, d.lists, values.absent), value, values);
  }
  return values;
}

/// The split of a sample. Samples with equal keys of 'dataset.split.by' share it.
std::string split_of_sample(SampleDraws& draws, const DrawnKeys& d, const SplitOptions& split,
                            const std::string& name, std::size_t seafloor) {
  bool by_seafloor = false;
  std::vector<std::string> group;
  for (const std::string& key : split.by)
    if (key == "seafloor")
      by_seafloor = true;
    else
      group.push_back(plain_text(draws.value(key, name + ": 'dataset.split.by'")));
  // The other keys are drawn once per seafloor: those of one seafloor agree in all of them.
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
  allow_only(d, scene.places, "output.png_bits", "8",
             "a dataset's pictures have 8 bits: leave it out; 'output.npz' writes the samples");
  for (const auto& [key, off] :
       {std::pair{"output.pings_per_file", "0"}, std::pair{"output.file_per_leg", "false"}})
    allow_only(d, scene.places, key, off,
               "a sample has one part: leave it out; 'dataset.tiles' cuts images into pieces");
  collect_files(d, scene, files_);
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

ScenePaths Recipe::paths() const {
  const std::filesystem::path folder = std::filesystem::path(name_).parent_path();
  return {folder.empty() ? "." : folder, data_folder_};
}

std::size_t Recipe::seafloors() const {
  return options_.seafloors > 0 ? static_cast<std::size_t>(options_.seafloors) : samples();
}

std::size_t Recipe::seafloor_of(std::size_t sample) const {
  return sample * seafloors() / samples();
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
        if (is_presence(key) || !in_absent(key, values.absent))
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
  return result;
}

std::vector<std::string> Recipe::class_names() const {
  std::vector<std::string> names = targets_;
  names.insert(names.end(), grounds_.begin(), grounds_.end());
  return names;
}
std::size_t Recipe::target_classes() const { return targets_.size(); }
std::vector<std::string> Recipe::material_names() const { return materials_; }
std::vector<std::string> Recipe::assets() const { return {files_.begin(), files_.end()}; }
std::filesystem::path Recipe::path_of(const std::string& asset) const {
  const ScenePaths all = paths();
  return asset.starts_with("data:") ? all.data_folder / asset.substr(5) : all.scene_folder / asset;
}

}  // namespace ensonify::engine
