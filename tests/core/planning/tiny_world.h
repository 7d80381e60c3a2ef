// Maps drawn in ASCII: each character is a square of half a metre, rows from north to south.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/planning/plan_route.h"
#include "core/planning/tile_source.h"

namespace atlas {

// To be drawn: start and goal at the ends of a street.
inline const std::vector<std::string_view> kCorridor = {
    "........................",  //
    "........................",  //
    "..S..................G..",  //
    "........................",  //
    "........................",
};

// '.' free, 'S' and 'G' free and remembered, '#' obstacle, '?' seen but never found free, 'c' free
// with something hanging at 1.5 m, ' ' never seen.
class TinyWorld : public TileSource {
 public:
  using Height = std::function<double(double x_m, double y_m)>;
  static constexpr int kCellsPerSquare = 5;

  // Cells of 0.1 m, 32 a tile side: routes cross many tiles.
  TinyWorld();

  // Draws one surface; surfaces drawn over each other must be drawn from below.
  void Draw(const std::vector<std::string_view>& rows, const Height& height);
  void Draw(const std::vector<std::string_view>& rows, double height_m);
  // One cell's layer on top of what is there.
  void Put(std::int64_t cell_x, std::int64_t cell_y, const TileLayer& layer);

  // Coarser levels are made of what is drawn so far; without this there are none, and no corridor.
  void BuildPyramid();

  Result<const Tile*> Get(const TileId& id) override;
  Result<Route> Plan(const PlanOptions& options = {});

  Eigen::Vector3d start() const { return start_; }
  Eigen::Vector3d goal() const { return goal_; }
  const MapProfile& profile() const { return profile_; }
  std::size_t tiles() const { return cells_.size(); }
  std::size_t tiles_asked() const { return tiles_asked_; }
  void FailFrom(Status status) { failure_ = std::move(status); }

 private:
  MapProfile profile_;
  Tile Finest(const TileId& id) const;

  std::map<std::uint64_t, std::vector<std::vector<TileLayer>>> cells_;
  std::map<std::uint64_t, Tile> coarser_;
  Tile tile_;  // lives until the next Get, as the contract says
  std::size_t tiles_asked_ = 0;
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d goal_ = Eigen::Vector3d::Zero();
  Status failure_;
};

TileLayer FreeLayer(double altitude_m);

}  // namespace atlas
