#include "tests/bench/accuracy/accuracy_score.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/nibble.h"

namespace atlas::testing {
namespace {

constexpr double kSameSurface_m = 1.0;

double AltitudeOf(const TileLayer& layer) {
  return layer.altitude_mm * 1e-3;
}

// Within a metre of `z_m`, or null.
const TileLayer* NearestLayer(std::span<const TileLayer> layers, double z_m) {
  const TileLayer* nearest = nullptr;
  double best_m = kSameSurface_m;
  for (const TileLayer& layer : layers) {
    const double away_m = std::abs(AltitudeOf(layer) - z_m);
    if (away_m < best_m) {
      best_m = away_m;
      nearest = &layer;
    }
  }
  return nearest;
}

bool IsColumnOccupied(const TileLayer& layer,
                      const MapProfile& profile,
                      double ground_m,
                      double low_m,
                      double high_m) {
  const std::int32_t base = ColumnBaseIndex(layer.altitude_mm, profile);
  for (int i = 0; i < profile.column_segments; ++i) {
    const double from_m = (base + i) * profile.segment_height_m();
    const bool overlaps =
        from_m < ground_m + high_m && from_m + profile.segment_height_m() > ground_m + low_m;
    const std::uint8_t state = NibbleAt(layer.column, i);
    if (overlaps && state != 0 && NibbleProbability(state) > 0.5) {
      return true;
    }
  }
  return false;
}

class Scorer {
 public:
  Scorer(const DriveMap& map, const TruthOptions& options) : map_(map), options_(options) {}

  void Add(const MapCell& cell, const CellTruth& truth) {
    const std::span<const TileLayer> layers = map_.Layers(cell);
    AddLayers(layers, truth);
    for (const SurfaceTruth& surface : truth.surfaces) {
      if (surface.is_counted) {
        AddSurface(NearestLayer(layers, surface.altitude_m), surface);
      }
    }
    for (const StructureTruth& structure : truth.structures) {
      if (structure.is_counted(options_.min_beams)) {
        AddStructure(cell, NearestLayer(layers, structure.ground_m), structure);
      }
    }
    if (!truth.has_low_obstacle) {
      for (const double ground_m : truth.moving_ground_m) {
        AddMoving(NearestLayer(layers, ground_m), ground_m);
      }
    }
  }

  const AccuracyScore& score() const { return score_; }

 private:
  void AddLayers(std::span<const TileLayer> layers, const CellTruth& truth) {
    if (!IsDecided(truth)) {
      return;
    }
    const CellVerdict verdict = JudgeLayers(layers, truth);
    score_.layers_right.Add(verdict == CellVerdict::kRight);
    score_.layers_real.Add(AreLayersReal(layers, truth));
    score_.cells_missing += verdict == CellVerdict::kMissing ? 1U : 0U;
    score_.cells_fewer += verdict == CellVerdict::kFewer ? 1U : 0U;
    score_.cells_more += verdict == CellVerdict::kMore ? 1U : 0U;
  }

  void AddSurface(const TileLayer* layer, const SurfaceTruth& surface) {
    const double error_m = layer == nullptr ? 0.0 : AltitudeOf(*layer) - surface.altitude_m;
    score_.altitude_square_sum_m2 += error_m * error_m;
    score_.surfaces_found.Add(layer != nullptr);
    score_.altitude_within_30mm.Add(layer != nullptr && std::abs(error_m) <= 0.03);
    if (surface.is_free) {
      TraversabilityTable& table = score_.traversability;
      Count(layer, table.free_free, table.free_occupied, table.free_unknown);
    }
  }

  void AddStructure(const MapCell& cell, const TileLayer* layer, const StructureTruth& structure) {
    const auto is_kept = [&](const MapCell& there) {
      return IsOccupied(map_, there, structure.ground_m, options_.structure_low_m, options_.high_m);
    };
    bool is_near = false;
    for (int n = 0; n < 9 && !is_near; ++n) {
      is_near = is_kept({cell.x + n % 3 - 1, cell.y + n / 3 - 1});
    }
    score_.static_kept.Add(is_kept(cell));
    score_.static_kept_nearby.Add(is_near);
    TraversabilityTable& table = score_.traversability;
    Count(layer, table.occupied_free, table.occupied_occupied, table.occupied_unknown);
  }

  void AddMoving(const TileLayer* layer, double ground_m) {
    const bool in_column =
        layer == nullptr ||  // a cell that is not in the map tells nothing
        IsColumnOccupied(*layer, map_.profile(), ground_m, options_.moving_low_m, options_.high_m);
    const bool on_surface = layer == nullptr || layer->occupancy > 0;
    score_.moving_gone.Add(!in_column && !on_surface);
    score_.moving_gone_columns.Add(!in_column);
    score_.moving_gone_surface.Add(!on_surface);
  }

  static void Count(const TileLayer* layer,
                    std::uint64_t& is_free,
                    std::uint64_t& is_occupied,
                    std::uint64_t& is_unknown) {
    if (layer != nullptr && layer->is_traversable()) {
      ++is_free;
    } else if (layer != nullptr && layer->occupancy > 0) {
      ++is_occupied;
    } else {
      ++is_unknown;
    }
  }

  const DriveMap& map_;
  const TruthOptions& options_;
  AccuracyScore score_;
};

}  // namespace

double AccuracyScore::altitude_rmse_m() const {
  const auto found = static_cast<double>(surfaces_found.good);
  return found == 0.0 ? 0.0 : std::sqrt(altitude_square_sum_m2 / found);
}

bool IsDecided(const CellTruth& truth) {
  return !truth.surfaces.empty() &&
         std::all_of(truth.surfaces.begin(), truth.surfaces.end(),
                     [](const SurfaceTruth& surface) { return surface.is_counted; });
}

CellVerdict JudgeLayers(std::span<const TileLayer> layers, const CellTruth& truth) {
  if (layers.empty()) {
    return CellVerdict::kMissing;
  }
  if (layers.size() == truth.surfaces.size()) {
    return CellVerdict::kRight;
  }
  return layers.size() < truth.surfaces.size() ? CellVerdict::kFewer : CellVerdict::kMore;
}

bool AreLayersReal(std::span<const TileLayer> layers, const CellTruth& truth) {
  constexpr double kNear_m = 0.3;
  for (const SurfaceTruth& surface : truth.surfaces) {
    const TileLayer* layer = NearestLayer(layers, surface.altitude_m);
    if (layer == nullptr || std::abs(AltitudeOf(*layer) - surface.altitude_m) >= kNear_m) {
      return false;
    }
  }
  std::vector<double> left_m = truth.ground_m;
  for (const TileLayer& layer : layers) {
    const auto found = std::find_if(left_m.begin(), left_m.end(), [&](double ground_m) {
      return std::abs(ground_m - AltitudeOf(layer)) < kNear_m;
    });
    if (found == left_m.end()) {
      return false;
    }
    left_m.erase(found);
  }
  return true;
}

bool IsOccupied(
    const DriveMap& map, const MapCell& cell, double ground_m, double low_m, double high_m) {
  const TileLayer* layer = NearestLayer(map.Layers(cell), ground_m);
  return layer != nullptr &&
         (layer->occupancy > 0 || IsColumnOccupied(*layer, map.profile(), ground_m, low_m, high_m));
}

AccuracyScore ScoreMap(const DriveMap& map, const TruthMap& truth, const TruthOptions& options) {
  Scorer scorer(map, options);
  for (const auto& [cell, cell_truth] : truth) {
    scorer.Add(cell, cell_truth);
  }
  return scorer.score();
}

}  // namespace atlas::testing
