// Where scans contradicted the map, as text that other programs read, and back.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/localization/monitor/contradiction.h"

namespace atlas {

enum class ContradictionFormat {
  kCsv,      // a line each; the first line names the columns
  kGeoJson,  // a FeatureCollection, a Point each at the cell's middle and the lowest segment's foot
};

// By the name's ending, .csv, or .geojson or .json; else kInvalidArgument.
Result<ContradictionFormat> ContradictionFormatOf(const std::string& file);

// Metres of the map's frame.
std::string ContradictionText(ContradictionFormat format,
                              std::span<const Contradiction> contradictions,
                              double cell_size_m);

// What a picture needs of them.
struct ContradictionPlace {
  ContradictionKind kind = ContradictionKind::kAppeared;
  Eigen::Vector2d center_m = Eigen::Vector2d::Zero();  // of the cell, map frame
};

// Of what ContradictionText wrote, by the file's ending. kInvalidArgument for another ending,
// kInvalidData for other content; else as ReadWholeFile.
Result<std::vector<ContradictionPlace>> ReadContradictions(const std::filesystem::path& file);

}  // namespace atlas
