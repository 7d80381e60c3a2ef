// Reads scans and their labels from files that may be anything.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/base/bytes.h"
#include "core/base/status.h"
#include "core/scan/point_cloud.h"

namespace atlas {

// A file's bytes. kNotFound, kPermissionDenied, kInvalidData when it is no file, or
// kResourceExhausted above `max_bytes`.
Result<Bytes> ReadFileBytes(const std::filesystem::path& path, std::size_t max_bytes);

// velodyne/NNNNNN.bin: float32 x y z intensity a return. Intensity is not believed or kept.
// kInvalidData: empty, not a multiple of 16 bytes, a coordinate that is not finite or is beyond 1
// km.
Result<PointCloud> ReadScan(const std::filesystem::path& path);
Result<PointCloud> ParseScan(ByteSpan bytes);

// labels/NNNNNN.label: uint32 a return, SemanticKITTI class in the low 16 bits. kInvalidData unless
// there is one for each return of the cloud.
Result<std::vector<std::uint32_t>> ReadLabels(const std::filesystem::path& path,
                                              const PointCloud& cloud);

}  // namespace atlas
