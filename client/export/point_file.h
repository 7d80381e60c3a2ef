// A cloud of points on disk as other programs read it, written as the points come: memory does not
// grow with it. The file appears whole or not at all.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include <Eigen/Core>

#include "core/base/status.h"
#include "core/tile/column_points.h"

namespace atlas {

enum class PointFormat {
  kPcd,  // PCD 0.7, binary: float32 x y z intensity
  kPly,  // PLY, binary, little endian: double x y z, float probability
};

// By the name's ending, .pcd or .ply in letters of either case; else kInvalidArgument.
Result<PointFormat> PointFormatOf(const std::filesystem::path& path);

// World frame less an origin, metres; intensity and probability are that of the segment's state,
// 0.1 to 0.9.
class PointFile {
 public:
  // Begins `path`.partial. kInvalidArgument for an unknown ending, kConflict where a folder has the
  // name, else as the disk says.
  static Result<PointFile> Create(const std::filesystem::path& path,
                                  const Eigen::Vector3d& origin_m = Eigen::Vector3d::Zero());
  PointFile(PointFile&&) noexcept = default;
  PointFile& operator=(PointFile&&) = delete;
  ~PointFile();  // an unfinished file is gone

  // Both fail as the disk does; nothing may follow a failure.
  Status Add(std::span<const ColumnPoint> points);
  Status Finish();

  std::uint64_t points() const { return points_; }
  // How far from the truth a coordinate may be written, for the points so far: float32 is right to
  // a millimetre within 16 km of the origin.
  double rounding_m() const;

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  PointFile(const std::filesystem::path& path, PointFormat format, const Eigen::Vector3d& origin_m);
  Status Write(const std::string& bytes);
  std::string Header() const;
  Status Failure(int error) const;

  std::filesystem::path path_;
  std::filesystem::path partial_;  // empty once finished
  PointFormat format_;
  Eigen::Vector3d origin_m_;
  double farthest_m_ = 0.0;  // from the origin, along an axis
  std::unique_ptr<std::FILE, Closer> file_;
  std::uint64_t points_ = 0;
};

}  // namespace atlas
