// How right a map is: simulated drives through front end and fusion, against the worlds they were
// simulated in. One JSON object a world and preset.
// Usage: accuracy_bench [--data DIR] [--pictures DIR] [--cells DIR] [WORLD ...]
// --pictures: a PNG of each; --cells: a text of each, a line a cell that is not as it should be.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "client/render/image.h"
#include "core/base/str_cat.h"
#include "tests/bench/accuracy/accuracy_picture.h"
#include "tests/bench/accuracy/accuracy_score.h"
#include "tests/bench/accuracy/bench_drive.h"

namespace atlas::testing {
namespace {

struct Arguments {
  std::string data;
  std::string cells;
  std::string pictures;
  std::vector<std::string> worlds;
};

void Print(const std::string& name, const AccuracyScore& score) {
  const TraversabilityTable& table = score.traversability;
  std::cout << "{\"name\": \"" << name << "\", \"layers_right\": " << score.layers_right.value()
            << ", \"layers_real\": " << score.layers_real.value()
            << ", \"cells\": " << score.layers_right.whole
            << ", \"missing\": " << score.cells_missing << ", \"fewer\": " << score.cells_fewer
            << ", \"more\": " << score.cells_more
            << ", \"altitude_rmse_m\": " << score.altitude_rmse_m()
            << ", \"altitude_within_30mm\": " << score.altitude_within_30mm.value()
            << ", \"surfaces_found\": " << score.surfaces_found.value()
            << ", \"surfaces\": " << score.surfaces_found.whole
            << ", \"moving_gone\": " << score.moving_gone.value()
            << ", \"moving_gone_columns\": " << score.moving_gone_columns.value()
            << ", \"moving_gone_surface\": " << score.moving_gone_surface.value()
            << ", \"moving_cells\": " << score.moving_gone.whole
            << ", \"static_kept\": " << score.static_kept.value()
            << ", \"static_kept_nearby\": " << score.static_kept_nearby.value()
            << ", \"static_cells\": " << score.static_kept.whole << ", \"free\": ["
            << table.free_free << ", " << table.free_occupied << ", " << table.free_unknown
            << "], \"occupied\": [" << table.occupied_free << ", " << table.occupied_occupied
            << ", " << table.occupied_unknown << "]}" << std::endl;
}

void ListCells(const DriveMap& map,
               const TruthMap& truth,
               const TruthOptions& options,
               const std::string& path) {
  std::ofstream file(path);
  const auto list = [&](const char* what, const MapCell& cell, double z_m) {
    const Eigen::Vector2d centre = cell.Centre(options.cell_m);
    file << what << " " << centre.x() << " " << centre.y() << " " << z_m << " :";
    for (const TileLayer& layer : map.Layers(cell)) {
      file << " [" << layer.altitude_mm * 1e-3 << " sigma " << layer.sigma_100um * 1e-4
           << " occupancy " << int{layer.occupancy} << " flags " << int{layer.flags} << " seen "
           << layer.observations << " column " << std::hex << layer.column << std::dec << "]";
    }
    file << "\n";
  };
  for (const auto& [cell, cell_truth] : truth) {
    const auto layers = map.Layers(cell);
    const bool is_wrong =
        IsDecided(cell_truth) && JudgeLayers(layers, cell_truth) != CellVerdict::kRight;
    for (const SurfaceTruth& surface : cell_truth.surfaces) {
      const bool is_far = std::none_of(layers.begin(), layers.end(), [&](const TileLayer& layer) {
        return std::abs(layer.altitude_mm * 1e-3 - surface.altitude_m) < 0.1;
      });
      if (surface.is_counted && is_far) list("altitude", cell, surface.altitude_m);
      const bool is_blocked =
          std::any_of(layers.begin(), layers.end(), [&](const TileLayer& layer) {
            return std::abs(layer.altitude_mm * 1e-3 - surface.altitude_m) < 0.3 &&
                   layer.occupancy > 0;
          });
      if (surface.is_counted && surface.is_free && is_blocked) {
        list("blocked", cell, surface.altitude_m);
      }
      if (is_wrong)
        list(AreLayersReal(layers, cell_truth) ? "real" : "count", cell, surface.altitude_m);
    }
    for (const StructureTruth& structure : cell_truth.structures) {
      if (structure.is_counted(options.min_beams) &&
          !IsOccupied(map, cell, structure.ground_m, options.structure_low_m, options.high_m)) {
        list("static", cell, structure.ground_m);
      }
    }
    for (const double ground_m : cell_truth.moving_ground_m) {
      if (!cell_truth.has_low_obstacle &&
          IsOccupied(map, cell, ground_m, options.moving_low_m, options.high_m)) {
        list("moving", cell, ground_m);
      }
    }
  }
}

Status Measure(const std::string& world, const Arguments& arguments) {
  const Result<SimulatedDrive> drive = MakeBenchDrive(world, arguments.data);
  if (!drive) return drive.error().WithContext(world);
  const TruthOptions options;
  const TruthMap truth = MeasureTruth(*drive, Vlp16Sensor(), options);
  for (const FusionPreset preset : {FusionPreset::kStrict, FusionPreset::kPaper}) {
    MapProfile profile;
    profile.preset = preset;
    const auto keyframes =
        BuildKeyframes(*drive, options.begin, options.end, profile, options.range_m);
    if (!keyframes) return keyframes.error().WithContext(world);
    const DriveMap map(*keyframes, profile);
    const std::string name = StrCat(world, preset == FusionPreset::kStrict ? ".strict" : ".paper");
    Print(name, ScoreMap(map, truth, options));
    if (!arguments.cells.empty()) {
      ListCells(map, truth, options, arguments.cells + "/" + name + ".txt");
    }
    if (!arguments.pictures.empty()) {
      ATLAS_RETURN_IF_ERROR(
          WritePng(DrawErrors(map, truth, options), arguments.pictures + "/" + name + ".png"));
    }
  }
  return {};
}

int Main(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--data" && i + 1 < argc) {
      arguments.data = argv[++i];
    } else if (word == "--pictures" && i + 1 < argc) {
      arguments.pictures = argv[++i];
    } else if (word == "--cells" && i + 1 < argc) {
      arguments.cells = argv[++i];
    } else {
      arguments.worlds.push_back(word);
    }
  }
  if (arguments.worlds.empty()) {
    arguments.worlds = {"street", "overpass", "garage", "mesh_garage", "mesh_interchange"};
  }
  for (const std::string& world : arguments.worlds) {
    if (const Status status = Measure(world, arguments); !status.ok()) {
      std::cerr << "accuracy_bench: " << status.message() << "\n";
      return EXIT_FAILURE;
    }
  }
  return EXIT_SUCCESS;
}

}  // namespace
}  // namespace atlas::testing

int main(int argc, char** argv) {
  return atlas::testing::Main(argc, argv);
}
