#include <ensonify/engine/image/ping_rendering.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <vector>

#include <Eigen/Geometry>

#include <ensonify/engine/base/made_once.h>
#include <ensonify/engine/base/units.h>
#include <ensonify/engine/trace/intersector.h>
#include <ensonify/refine/parallel_for.h>

namespace ensonify::engine {
namespace {

using Eigen::Array3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int samples = 3;  // a pixel has samples x samples rays

double to_linear(double byte) { return std::pow(byte / 255.0, 2.2); }
std::uint8_t to_byte(double linear) {
  return static_cast<std::uint8_t>(
      std::lround(255.0 * std::pow(std::clamp(linear, 0.0, 1.0), 1.0 / 2.2)));
}
Array3d rgb(int red, int green, int blue) {
  return {to_linear(red), to_linear(green), to_linear(blue)};
}
double step_between(double low, double high, double x) {
  const double s = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}
Array3d mix(const Array3d& from, const Array3d& to, double share) {
  return from + share * (to - from);
}

/// How a face is painted. Those before `torpedo` are solid faces, which show their edges; the
/// others are transparent and in front of the solid faces.
enum Finish : std::uint8_t {
  coarse_bed,
  exact_bed,
  coarse_object,
  exact_object,
  torpedo,
  sheet,
  sheet_edge,
  sheet_foot,
  past_track,
  track_ahead,
  plumb_line
};
struct Look {
  Array3d colour;  // linear light
  double opacity;
};
std::array<Look, 11> made_looks() {
  return {{{rgb(104, 136, 150), 1.0},
           {rgb(232, 176, 92), 1.0},
           {rgb(120, 160, 120), 1.0},
           {rgb(232, 110, 84), 1.0},
           {rgb(250, 214, 64), 1.0},
           {rgb(110, 220, 240), 0.14},
           {rgb(170, 240, 250), 0.85},
           {rgb(190, 245, 255), 0.6},
           {rgb(255, 255, 255), 0.8},
           {rgb(255, 255, 255), 0.3},
           {rgb(255, 255, 255), 0.5}}};
}
const Look& look_of(Finish finish) { return made_once<made_looks>()[finish]; }
const Array3d edge_colour = rgb(14, 28, 46);
const Array3d sky_top = rgb(6, 14, 30), sky_bottom = rgb(24, 52, 82);
constexpr double edge_px = 1.0, line_px = 2.0;

/// Triangles, each with its finish.
struct Model {
  std::vector<Eigen::Vector3f> positions;
  std::vector<refine::Face> faces;
  std::vector<Finish> finish;

  operator refine::Triangles() const { return {positions, faces, {}}; }
  std::uint32_t add(const Vector3d& position) {
    positions.emplace_back(position.cast<float>());
    return static_cast<std::uint32_t>(positions.size() - 1);
  }
  void add(const refine::Face& face, Finish of) {
    faces.push_back(face);
    finish.push_back(of);
  }
};

std::vector<Hit> trace(const Intersector& tracer, const std::vector<Ray>& rays) {
  std::vector<Hit> hits(rays.size());
  tracer.intersect(rays, hits);
  return hits;
}

void add_mesh(Model& model, const ViewSubject& subject) {
  const refine::ActiveMesh& mesh = subject.mesh;
  const auto nodes = mesh.nodes();
  for (std::uint32_t v = 0; v < nodes.size(); ++v)
    model.positions.push_back(nodes[v].is_active() ? mesh.position(v) : Eigen::Vector3f::Zero());
  for (const refine::ActiveMesh::ActiveFace& face : mesh.faces()) {
    if (face.slot == refine::ActiveMesh::none) continue;
    const bool exact =
        std::ranges::all_of(face.vertices, [&](std::uint32_t v) { return nodes[v].is_leaf(); });
    const bool object = face.source >= subject.seafloor.bed_faces;
    model.add(face.vertices, object  ? exact ? exact_object : coarse_object
                             : exact ? exact_bed
                                     : coarse_bed);
  }
}

/// Adds the sonar's shape: a body of revolution along the sonar's x axis, and four fins.
void add_torpedo(Model& model, const Pose& pose, double length_m) {
  constexpr std::uint32_t corners = 32;
  constexpr std::array<std::array<double, 2>, 9> outline{{{0.5, 0.0},
                                                          {0.49, 0.025},
                                                          {0.46, 0.05},
                                                          {0.41, 0.068},
                                                          {0.34, 0.075},
                                                          {-0.22, 0.075},
                                                          {-0.36, 0.055},
                                                          {-0.48, 0.02},
                                                          {-0.5, 0.0}}};
  const Eigen::Matrix3d body = body_to_world(pose);
  const auto place = [&](double x, double radius, double angle) {
    return model.add(pose.position + length_m * (body * Vector3d(x, radius * std::cos(angle),
                                                                 radius * std::sin(angle))));
  };
  const auto first = static_cast<std::uint32_t>(model.positions.size());
  for (const auto& [x, radius] : outline)
    for (std::uint32_t i = 0; i < corners; ++i)
      place(x, radius, 2.0 * std::numbers::pi * i / corners);
  for (std::uint32_t ring = 0; ring + 1 < outline.size(); ++ring)
    for (std::uint32_t i = 0; i < corners; ++i) {
      const std::uint32_t a = first + ring * corners + i;
      const std::uint32_t b = first + ring * corners + (i + 1) % corners;
      model.add({a, b, b + corners}, torpedo);
      model.add({a, b + corners, a + corners}, torpedo);
    }
  for (int fin = 0; fin < 4; ++fin) {
    const double angle = (0.25 + 0.5 * fin) * std::numbers::pi;
    const std::uint32_t a = place(-0.28, 0.05, angle), b = place(-0.4, 0.15, angle),
                        c = place(-0.5, 0.15, angle), d = place(-0.48, 0.0, angle);
    model.add({a, b, c}, torpedo);
    model.add({a, c, d}, torpedo);
  }
}

/// Adds a line as a ribbon that faces the camera and has the same width everywhere in the picture.
void add_line(Model& model, const Camera& camera, const std::vector<Vector3d>& points,
              Finish finish, double width_px = line_px) {
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector3d along = points[std::min(i + 1, points.size() - 1)] - points[i == 0 ? 0 : i - 1];
    const Vector3d sight = points[i] - camera.eye;
    const Vector3d aside =
        along.cross(sight).stableNormalized() * sight.norm() * (0.5 * width_px / camera.focal_px);
    const std::uint32_t left = model.add(points[i] + aside);
    model.add(points[i] - aside);
    if (i > 0) {
      model.add({last, last + 1, left + 1}, finish);
      model.add({last, left + 1, left}, finish);
    }
    last = left;
  }
}

/// The rays of a fan's middle plane. They end at the bed, or in the water at full range.
struct FanOutline {
  Vector3d origin;
  std::vector<Vector3d> ends;
  std::vector<Hit> hits;
};

FanOutline trace_outline(const Intersector& tracer, const RayFan& fan) {
  std::vector<Ray> rays;
  for (std::size_t e = 0; e < fan.elevations(); ++e)
    rays.push_back({fan.origin, fan.direction(fan.middle, e), 0.0, fan.range_m});
  FanOutline out{fan.origin, {}, trace(tracer, rays)};
  for (std::size_t e = 0; e < rays.size(); ++e)
    out.ends.emplace_back(fan.origin + std::min(out.hits[e].t, fan.range_m) * rays[e].direction);
  return out;
}

void add_sheet(Model& model, const Camera& camera, const FanOutline& outline, double range_m) {
  // A triangle between two rays would be long and thin, with a large bounding box, and each ray of
  // the picture would meet many such boxes.
  constexpr std::uint32_t pieces = 16;
  const std::uint32_t origin = model.add(outline.origin);
  for (std::size_t i = 0; i < outline.ends.size(); ++i)
    for (std::uint32_t piece = 1; piece <= pieces; ++piece) {
      const std::uint32_t at =
          model.add(outline.origin + double(piece) / pieces * (outline.ends[i] - outline.origin));
      if (i == 0) continue;
      model.add({piece == 1 ? origin : at - 1, at - pieces, at}, sheet);
      if (piece > 1) model.add({at - 1, at - pieces - 1, at - pieces}, sheet);
    }
  add_line(model, camera, {outline.origin, outline.ends.back()}, sheet_edge, 0.5 * line_px);
  // The line where the sheet meets the bed, with gaps at shadows. It is drawn a little nearer to
  // the camera, so that the bed does not hide half of the line's width.
  std::vector<Vector3d> foot;
  for (std::size_t i = 0; i <= outline.hits.size(); ++i) {
    const bool ends =
        i == outline.hits.size() || !outline.hits[i] ||
        (!foot.empty() && std::abs(outline.hits[i].t - outline.hits[i - 1].t) > 0.02 * range_m);
    if (ends) {
      add_line(model, camera, foot, sheet_foot, 0.6 * line_px);
      foot.clear();
    }
    if (i < outline.hits.size() && outline.hits[i])
      foot.emplace_back(outline.ends[i] + 0.004 * (camera.eye - outline.ends[i]));
  }
}

/// A camera behind the sonar and to starboard. Of several heights it has the lowest one that is
/// above the bed and from which the sonar and at least 3/4 of the bed under the fans are visible.
Camera choose_camera(const Intersector& tracer, const ViewSubject& subject,
                     const std::vector<FanOutline>& outlines, const Vector2d& size_px) {
  const Pose& pose = subject.track[subject.ping];
  std::vector<Vector3d> points{pose.position}, beds;
  for (const FanOutline& outline : outlines)
    for (std::size_t i = 0; i < outline.ends.size(); i += 1 + outline.ends.size() / 200) {
      points.push_back(outline.ends[i]);
      if (outline.hits[i]) beds.push_back(outline.ends[i]);
    }
  const double bearing = pose.heading_rad - 55.0 * degree;  // of the view
  Camera camera;
  for (const double down : {22.0, 30.0, 40.0, 55.0, 75.0}) {
    const double level = std::cos(down * degree);
    camera =
        look_along({level * std::sin(bearing), level * std::cos(bearing), -std::sin(down * degree)},
                   points, size_px);
    std::vector<Ray> sights;
    for (const Vector3d& to : beds) sights.push_back({camera.eye, to - camera.eye, 0.0, 0.995});
    const std::vector<Hit> hidden = trace(tracer, sights);
    const auto count = static_cast<std::size_t>(
        std::ranges::count_if(hidden, [](const Hit& hit) { return bool(hit); }));
    const std::vector<Hit> musts = trace(
        tracer,
        {{camera.eye, Vector3d::UnitZ()}, {camera.eye, pose.position - camera.eye, 0.0, 1.0}});
    if (!musts[0] && !musts[1] && count <= beds.size() / 4) break;
  }
  return camera;
}

/// A step that divides `whole` into about five steps: 1, 2 or 5 times a power of ten.
double round_step(double whole) {
  const double power = std::pow(10.0, std::floor(std::log10(whole / 5.0)));
  const double rest = whole / 5.0 / power;
  return power * (rest < 1.5 ? 1.0 : rest < 3.5 ? 2.0 : rest < 7.5 ? 5.0 : 10.0);
}

/// The scene of the picture, and its colours.
class Painter {
 public:
  Painter(const ViewSubject& subject, const Vector2d& size_px);
  const Camera& camera() const { return camera_; }
  void paint_row(std::size_t row, std::span<std::uint8_t> pixels) const;

 private:
  /// A point on a face, and its movement on the face per pixel to the right and down.
  struct Spot {
    Vector3d point, normal, right, down;
    std::array<Vector3d, 3> corners;
  };
  Spot spot(const Model& model, const Ray& ray, const Hit& hit) const;
  Array3d solid_colour(const Spot& at, Finish finish, bool in_shadow) const;
  double edge_share(const Spot& at) const;
  double ring_share(const Spot& at) const;
  void place_light();
  void lay_over(const std::vector<Ray>& rays, const std::vector<Hit>& solids,
                std::vector<Array3d>& colours) const;

  Camera camera_;
  Vector2d size_px_;
  Model solid_, clear_;
  std::unique_ptr<Intersector> solid_tracer_, clear_tracer_;
  Vector3d sonar_, to_light_;
  double range_m_ = 0.0, ring_m_ = 0.0, lowest_m_ = 1e30, highest_m_ = -1e30;  // of the bed
};

Painter::Painter(const ViewSubject& subject, const Vector2d& size_px) : size_px_(size_px) {
  const Pose& pose = subject.track[subject.ping];
  sonar_ = pose.position;
  for (const RayFan& fan : subject.fans) range_m_ = std::max(range_m_, fan.range_m);
  ring_m_ = round_step(range_m_);

  add_mesh(solid_, subject);
  solid_tracer_ = make_intersector("embree", solid_);
  std::vector<FanOutline> outlines;
  for (const RayFan& fan : subject.fans) outlines.push_back(trace_outline(*solid_tracer_, fan));
  camera_ = choose_camera(*solid_tracer_, subject, outlines, size_px);
  const Hit below = trace(*solid_tracer_, {{sonar_, -Vector3d::UnitZ()}}).front();

  for (const FanOutline& outline : outlines) add_sheet(clear_, camera_, outline, range_m_);
  std::vector<Vector3d> places;
  for (const Pose& at : subject.track) places.push_back(at.position);
  const auto here = places.begin() + static_cast<std::ptrdiff_t>(subject.ping);
  add_line(clear_, camera_, {places.begin(), here + 1}, past_track);
  add_line(clear_, camera_, {here, places.end()}, track_ahead);
  if (below) add_line(clear_, camera_, {sonar_, sonar_ - below.t * Vector3d::UnitZ()}, plumb_line);

  // The torpedo is not to scale, so it is among the faces that cast no shadow.
  add_torpedo(clear_, pose, 0.1 * range_m_);
  clear_tracer_ = make_intersector("embree", clear_);
  place_light();
}

/// The light comes from the side and a little from behind the camera. The gentler the bed's slopes,
/// the lower the light, so that the slopes are visible.
void Painter::place_light() {
  double slopes = 0.0, area = 0.0;
  for (std::size_t f = 0; f < solid_.faces.size(); ++f) {
    if (solid_.finish[f] > exact_bed) continue;
    const auto& [a, b, c] = solid_.faces[f];
    const std::array<Vector3d, 3> p{solid_.positions[a].cast<double>(),
                                    solid_.positions[b].cast<double>(),
                                    solid_.positions[c].cast<double>()};
    const Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
    if (normal.norm() > 0.0) slopes += normal.head<2>().squaredNorm() / normal.norm();
    area += normal.norm();
    for (const Vector3d& corner : p) {
      lowest_m_ = std::min(lowest_m_, corner.z());
      highest_m_ = std::max(highest_m_, corner.z());
    }
  }
  const double rise = area > 0.0 ? std::clamp(4.0 * std::sqrt(slopes / area), 0.4, 1.0) : 1.0;
  Vector3d ahead = camera_.forward;
  ahead.z() = 0.0;
  to_light_ = (-0.9 * camera_.right - 0.7 * ahead.normalized()).normalized();
  to_light_.z() = rise;
  to_light_.normalize();
}

Painter::Spot Painter::spot(const Model& model, const Ray& ray, const Hit& hit) const {
  const refine::Triangles triangles = model;
  Spot at;
  for (int k = 0; k < 3; ++k)
    at.corners[static_cast<std::size_t>(k)] = triangles.corner(hit.face, k);
  const auto& [a, b, c] = at.corners;
  at.point = ray.origin + hit.t * ray.direction;
  at.normal = (b - a).cross(c - a).stableNormalized();
  if (at.normal.dot(ray.direction) > 0.0) at.normal = -at.normal;
  const auto move = [&](const Vector3d& turn) -> Vector3d {
    return hit.t / camera_.focal_px *
           (turn - at.normal.dot(turn) / at.normal.dot(ray.direction) * ray.direction);
  };
  at.right = move(camera_.right);
  at.down = move(-camera_.up);
  return at;
}

/// The share of a sample (one of a pixel's rays) that an edge of its face covers. It goes to 0 for
/// faces as small as pixels.
double Painter::edge_share(const Spot& at) const {
  double nearest_px = 1e9, smallest_px = 1e9;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3d& from = at.corners[k];
    const Vector3d along = at.corners[(k + 1) % 3] - from;
    const Vector3d across = at.normal.cross(along);
    const double height = across.dot(at.corners[(k + 2) % 3] - from);
    const double per_px = std::hypot(across.dot(at.right), across.dot(at.down));
    nearest_px = std::min(nearest_px, std::abs(across.dot(at.point - from)) / per_px);
    smallest_px = std::min(smallest_px, std::abs(height) / per_px);
  }
  return std::clamp(0.5 * edge_px + 0.5 - nearest_px, 0.0, 1.0) *
         step_between(1.5, 8.0, smallest_px);
}

/// The share of a sample that a ring of equal range covers.
double Painter::ring_share(const Spot& at) const {
  const Vector3d out = at.point - sonar_;
  const double range_m = out.norm();
  const double per_px = std::hypot(out.dot(at.right), out.dot(at.down)) / range_m;
  const double off_px = std::abs(range_m - ring_m_ * std::round(range_m / ring_m_)) / per_px;
  return range_m < 0.5 * ring_m_ ? 0.0 : std::clamp(1.0 - off_px, 0.0, 1.0);
}

Array3d Painter::solid_colour(const Spot& at, Finish finish, bool in_shadow) const {
  const double sky = 0.5 + 0.5 * at.normal.z();
  const double lit = std::max(0.0, at.normal.dot(to_light_)) / to_light_.z();  // a level bed: 1
  const double direct = in_shadow ? 0.0 : std::min(lit, 2.2);
  Array3d colour = look_of(finish).colour;
  const double height = (at.point.z() - lowest_m_) / std::max(highest_m_ - lowest_m_, 1e-6);
  colour *= 0.75 + 0.5 * std::clamp(height, 0.0, 1.0);
  colour *= 0.4 * sky + 0.6 * direct;
  return mix(colour, edge_colour, 0.75 * edge_share(at));
}

/// Blends sheets and lines over the solid faces.
void Painter::lay_over(const std::vector<Ray>& rays, const std::vector<Hit>& solids,
                       std::vector<Array3d>& colours) const {
  constexpr int most = 8;  // layers; those farther away are hardly visible
  constexpr double beyond = 1.0 + 1e-5;
  struct Layer {
    Array3d colour = Array3d::Zero();
    double clear = 1.0;  // share of the light from behind that passes
  };
  std::vector<Layer> layers(rays.size());
  std::vector<std::size_t> at(rays.size());
  std::vector<Ray> going = rays;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    at[i] = i;
    going[i].t_max = solids[i].t;
  }
  for (int layer = 0; layer < most && !going.empty(); ++layer) {
    const std::vector<Hit> hits = trace(*clear_tracer_, going);
    std::size_t left = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (!hits[i]) continue;
      const Finish finish = clear_.finish[hits[i].face];
      auto [colour, opacity] = look_of(finish);
      if (finish == torpedo) {
        const Vector3d normal = spot(clear_, going[i], hits[i]).normal;
        colour *= 0.75 - 0.25 * normal.dot(camera_.forward) + 0.25 * normal.z();
      } else if (finish == sheet) {
        const Spot here = spot(clear_, going[i], hits[i]);
        const double out = (here.point - sonar_).norm() / range_m_;
        opacity *= 0.7 + 1.5 * std::exp(-6.0 * out);
        opacity += 0.35 * ring_share(here);
      }
      Layer& sum = layers[at[i]];
      sum.colour += sum.clear * opacity * colour;
      sum.clear *= 1.0 - opacity;
      at[left] = at[i];
      going[left] = going[i];
      going[left].t_min = hits[i].t * beyond;
      if (going[left].t_min < going[left].t_max) ++left;
    }
    at.resize(left);
    going.resize(left);
  }
  for (std::size_t i = 0; i < rays.size(); ++i)
    colours[i] = layers[i].colour + layers[i].clear * colours[i];
}

void Painter::paint_row(std::size_t row, std::span<std::uint8_t> pixels) const {
  std::vector<Ray> rays;
  for (std::size_t column = 0; column < pixels.size() / 3; ++column)
    for (int down = 0; down < samples; ++down)
      for (int across = 0; across < samples; ++across)
        rays.push_back(
            {camera_.eye, camera_.direction({static_cast<double>(column) + (across + 0.5) / samples,
                                             static_cast<double>(row) + (down + 0.5) / samples})});
  const std::vector<Hit> hits = trace(*solid_tracer_, rays);

  std::vector<Ray> to_light;
  std::vector<Spot> spots;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!hits[i]) continue;
    spots.push_back(spot(solid_, rays[i], hits[i]));
    const double off_m = 1e-4 * hits[i].t;  // a face must not shadow itself
    to_light.push_back({spots.back().point + off_m * spots.back().normal, to_light_});
  }
  const std::vector<Hit> shadows = trace(*solid_tracer_, to_light);

  const double down = (static_cast<double>(row) + 0.5) / size_px_.y();
  const Array3d sky = mix(sky_top, sky_bottom, down);
  const double haze_m = 2.5 * (sonar_ - camera_.eye).norm();
  std::vector<Array3d> colours(rays.size(), sky);
  for (std::size_t i = 0, solid = 0; i < rays.size(); ++i) {
    if (!hits[i]) continue;
    const double far = hits[i].t / haze_m;
    colours[i] = mix(solid_colour(spots[solid], solid_.finish[hits[i].face], bool(shadows[solid])),
                     sky, 1.0 - std::exp(-far * far));
    ++solid;
  }
  lay_over(rays, hits, colours);

  constexpr std::size_t square = samples * samples;
  for (std::size_t column = 0; column < pixels.size() / 3; ++column) {
    Array3d sum = Array3d::Zero();
    for (std::size_t s = 0; s < square; ++s) sum += colours[column * square + s].min(1.0);
    for (int channel = 0; channel < 3; ++channel)
      pixels[3 * column + static_cast<std::size_t>(channel)] = to_byte(sum[channel] / square);
  }
}

}  // namespace

PingRendering shade(const ViewSubject& subject, const ViewOptions& options) {
  if (options.width_px == 0 || options.height_px == 0)
    throw std::invalid_argument("shade: the picture has no pixels");
  if (subject.fans.empty() || subject.ping >= subject.track.size())
    throw std::invalid_argument("shade: no fans, or the ping is not on the track");
  const Painter painter(subject, Vector2d(static_cast<double>(options.width_px),
                                          static_cast<double>(options.height_px)));
  Picture picture{options.width_px, options.height_px, 3, {}};
  const std::size_t row_bytes = 3 * picture.width;
  picture.pixels.resize(row_bytes * picture.height);
  std::mutex telling;
  std::size_t done = 0;
  refine::parallel_for(picture.height, options.threads, [&](std::size_t row, int) {
    painter.paint_row(row, std::span(picture.pixels).subspan(row * row_bytes, row_bytes));
    const std::lock_guard lock(telling);
    if (options.progress) options.progress(++done, picture.height);
  });
  return {std::move(picture), painter.camera()};
}

}  // namespace ensonify::engine
