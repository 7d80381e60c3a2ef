#include "client/export/point_file.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <limits>
#include <system_error>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"
#include "core/geometry/nibble.h"

namespace atlas {
namespace {

// Whatever the count of points is, the header takes as much room: blanks end its comment.
constexpr std::size_t kHeaderBytes = 256;

template <typename Bits>
void Append(Bits bits, std::string& bytes) {
  for (std::size_t i = 0; i < sizeof(bits); ++i) {
    bytes += static_cast<char>((bits >> (8 * i)) & 0xFF);
  }
}
void AppendFloat(double value, std::string& bytes) {
  Append(std::bit_cast<std::uint32_t>(static_cast<float>(value)), bytes);
}
void AppendDouble(double value, std::string& bytes) {
  Append(std::bit_cast<std::uint64_t>(value), bytes);
}

std::string Padded(const std::string& comment, const std::string& rest) {
  return comment + std::string(kHeaderBytes - comment.size() - 1 - rest.size(), ' ') + '\n' + rest;
}

std::string PcdHeader(std::uint64_t points) {
  return Padded(
      "# .PCD v0.7 - Point Cloud Data file format",
      StrCat("VERSION 0.7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\n"
             "COUNT 1 1 1 1\nWIDTH ",
             points, "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS ", points, "\nDATA binary\n"));
}

std::string PlyHeader(std::uint64_t points) {
  return Padded("ply\nformat binary_little_endian 1.0\ncomment columns of a road atlas",
                StrCat("element vertex ", points,
                       "\nproperty double x\nproperty double y\nproperty double z\n"
                       "property float probability\nend_header\n"));
}

}  // namespace

Result<PointFormat> PointFormatOf(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (ending == ".pcd") return PointFormat::kPcd;
  if (ending == ".ply") return PointFormat::kPly;
  return Error(StatusCode::kInvalidArgument,
               StrCat(path.string(), ": expected a name that ends in .pcd or .ply"));
}

Result<PointFile> PointFile::Create(const std::filesystem::path& path,
                                    const Eigen::Vector3d& origin_m) {
  const Result<PointFormat> format = PointFormatOf(path);
  if (!format) return Error(format.error());
  PointFile file(path, *format, origin_m);
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return Error(file.Failure(EISDIR));
  file.file_.reset(std::fopen(file.partial_.c_str(), "wb"));
  if (file.file_ == nullptr) return Error(file.Failure(errno));
  if (Status status = file.Write(file.Header()); !status.ok()) return Error(std::move(status));
  return file;
}

PointFile::PointFile(const std::filesystem::path& path,
                     PointFormat format,
                     const Eigen::Vector3d& origin_m)
    : path_(path), partial_(path.string() + ".partial"), format_(format), origin_m_(origin_m) {}

PointFile::~PointFile() {
  if (file_ == nullptr) return;  // finished, moved from, or never opened
  file_.reset();
  std::error_code error;
  std::filesystem::remove(partial_, error);
}

std::string PointFile::Header() const {
  return format_ == PointFormat::kPcd ? PcdHeader(points_) : PlyHeader(points_);
}

Status PointFile::Failure(int error) const {
  return DiskError("cannot write", path_, error != 0 ? error : EIO);
}

Status PointFile::Write(const std::string& bytes) {
  errno = 0;
  const std::size_t written = std::fwrite(bytes.data(), 1, bytes.size(), file_.get());
  return written == bytes.size() ? Status() : Failure(errno);
}

Status PointFile::Add(std::span<const ColumnPoint> points) {
  std::string bytes;
  for (const ColumnPoint& point : points) {
    const Eigen::Vector3d p = point.p_world - origin_m_;
    farthest_m_ = std::max(farthest_m_, p.lpNorm<Eigen::Infinity>());
    for (const double coordinate : p) {
      format_ == PointFormat::kPcd ? AppendFloat(coordinate, bytes)
                                   : AppendDouble(coordinate, bytes);
    }
    AppendFloat(NibbleProbability(point.state), bytes);
  }
  points_ += points.size();
  return Write(bytes);
}

double PointFile::rounding_m() const {
  if (format_ == PointFormat::kPly) return 0.0;
  const auto farthest = static_cast<float>(farthest_m_);
  const float next = std::nextafter(farthest, std::numeric_limits<float>::infinity());
  return 0.5 * (static_cast<double>(next) - static_cast<double>(farthest));
}

Status PointFile::Finish() {
  errno = 0;
  if (std::fseek(file_.get(), 0, SEEK_SET) != 0) return Failure(errno);
  ATLAS_RETURN_IF_ERROR(Write(Header()));
  errno = 0;
  if (std::fflush(file_.get()) != 0) return Failure(errno);
  std::error_code error;
  std::filesystem::rename(partial_, path_, error);
  if (error) return Failure(error.value());
  file_.reset();
  return {};
}

}  // namespace atlas
