#include "core/scan/scan_reader.h"

#include <bit>
#include <cmath>
#include <fstream>
#include <system_error>

#include "core/base/str_cat.h"

namespace atlas {
namespace {

constexpr std::size_t kPointBytes = 16;
constexpr std::size_t kMaxScanBytes = 64u << 20;  // 4 million returns
constexpr float kMaxCoordinate_m = 1000.0F;

bool IsNear(const Eigen::Vector3f& p) {
  return p.cwiseAbs().maxCoeff() <= kMaxCoordinate_m;
}

// Without those of entries that are no returns.
std::vector<std::uint32_t> LabelsOfReturns(ByteSpan bytes, const PointCloud& cloud) {
  std::vector<std::uint32_t> labels;
  labels.reserve(cloud.size());
  ByteReader in(bytes);
  auto dropped = cloud.dropped.begin();
  for (std::uint32_t i = 0; in.remaining() > 0; ++i) {
    const std::uint32_t label = in.U32();
    if (dropped != cloud.dropped.end() && *dropped == i) {
      ++dropped;
    } else {
      labels.push_back(label);
    }
  }
  return labels;
}

Status FileError(const std::filesystem::path& path, const std::error_code& error) {
  StatusCode code = StatusCode::kInvalidData;  // a folder, a pipe
  if (error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory) {
    code = StatusCode::kNotFound;
  } else if (error == std::errc::permission_denied) {
    code = StatusCode::kPermissionDenied;
  }
  return {code, StrCat(path.string(), ": ", error.message())};
}

}  // namespace

Result<Bytes> ReadFileBytes(const std::filesystem::path& path, std::size_t max_bytes) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) {
    return Error(FileError(path, error));
  }
  if (size > max_bytes) {
    return Error(StatusCode::kResourceExhausted,
                 StrCat(path.string(), ": ", size, " bytes, at most ", max_bytes, " are read"));
  }
  std::ifstream file(path, std::ios::binary);
  Bytes bytes(static_cast<std::size_t>(size));
  // A stream reads characters; the buffer is bytes.
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
    return Error(StatusCode::kPermissionDenied, StrCat(path.string(), ": cannot be read"));
  }
  return bytes;
}

Result<PointCloud> ParseScan(ByteSpan bytes) {
  if (bytes.empty()) {
    return Error(StatusCode::kInvalidData, "the scan is empty");
  }
  if (bytes.size() % kPointBytes != 0) {
    return Error(StatusCode::kInvalidData, StrCat("the scan is truncated: ", bytes.size(),
                                                  " bytes, expected a multiple of ", kPointBytes));
  }
  PointCloud cloud;
  cloud.points.reserve(bytes.size() / kPointBytes);
  ByteReader in(bytes);
  for (std::uint32_t i = 0; in.remaining() > 0; ++i) {
    Eigen::Vector3f p;
    for (float& coordinate : p) coordinate = std::bit_cast<float>(in.U32());
    in.U32();  // intensity
    if (!p.allFinite()) {
      cloud.dropped.push_back(i);
      continue;
    }
    if (!IsNear(p)) {
      return Error(StatusCode::kInvalidData, StrCat("return ", i, " at (", p.x(), ", ", p.y(), ", ",
                                                    p.z(), ") m: expected it within 1000 m"));
    }
    cloud.points.push_back(p);
  }
  if (cloud.points.empty()) {
    return Error(StatusCode::kInvalidData,
                 StrCat("the scan has no return: none of its ", cloud.dropped.size(),
                        " entries has finite coordinates"));
  }
  return cloud;
}

Result<PointCloud> ReadScan(const std::filesystem::path& path) {
  Result<Bytes> bytes = ReadFileBytes(path, kMaxScanBytes);
  if (!bytes) {
    return Error(bytes.error());
  }
  Result<PointCloud> cloud = ParseScan(*bytes);
  return cloud ? std::move(cloud) : Error(cloud.error().WithContext(path.string()));
}

Result<std::vector<std::uint32_t>> ReadLabels(const std::filesystem::path& path,
                                              const PointCloud& cloud) {
  Result<Bytes> bytes = ReadFileBytes(path, kMaxScanBytes);
  if (!bytes) {
    return Error(bytes.error());
  }
  const std::size_t entries = cloud.size() + cloud.dropped.size();
  if (bytes->size() != 4 * entries) {
    return Error(StatusCode::kInvalidData, StrCat(path.string(), ": ", bytes->size(), " bytes for ",
                                                  entries, " returns, expected 4 each"));
  }
  return LabelsOfReturns(*bytes, cloud);
}

}  // namespace atlas
