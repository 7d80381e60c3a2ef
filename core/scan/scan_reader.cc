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

bool IsPlausible(float value) {
  return std::isfinite(value) && std::abs(value) <= kMaxCoordinate_m;
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
  while (in.remaining() > 0) {
    const auto x = std::bit_cast<float>(in.U32());
    const auto y = std::bit_cast<float>(in.U32());
    const auto z = std::bit_cast<float>(in.U32());
    in.U32();  // intensity
    if (!IsPlausible(x) || !IsPlausible(y) || !IsPlausible(z)) {
      return Error(StatusCode::kInvalidData,
                   StrCat("return ", cloud.size(), " at (", x, ", ", y, ", ", z,
                          ") m: expected finite coordinates within 1000 m"));
    }
    cloud.points.emplace_back(x, y, z);
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
  if (bytes->size() != 4 * cloud.size()) {
    return Error(StatusCode::kInvalidData, StrCat(path.string(), ": ", bytes->size(), " bytes for ",
                                                  cloud.size(), " returns, expected 4 each"));
  }
  std::vector<std::uint32_t> labels(cloud.size());
  ByteReader in(*bytes);
  for (std::uint32_t& label : labels) {
    label = in.U32();
  }
  return labels;
}

}  // namespace atlas
