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

// velodyne/NNNNNN.bin: float32 x y z intensity a return. Intensity is not believed or kept. An
// entry with a coordinate that is not finite is no return, and dropped: drivers write NaN or
// infinity where nothing came back. kInvalidData: empty, not a multiple of 16 bytes, a coordinate
// beyond 1 km, or no return at all.
Result<PointCloud> ReadScan(const std::filesystem::path& path);
Result<PointCloud> ParseScan(ByteSpan bytes);

// labels/NNNNNN.label: uint32 an entry of the scan's file, SemanticKITTI class in the low 16 bits.
// One for each return of the cloud, those of dropped entries left out. kInvalidData unless there is
// one for each entry.
Result<std::vector<std::uint32_t>> ReadLabels(const std::filesystem::path& path,
                                              const PointCloud& cloud);

}  // namespace atlas
