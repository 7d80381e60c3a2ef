// Files with every error looked at, the closing one included.
#include "core/simulation/drive_writer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "core/base/disk_error.h"
#include "core/base/str_cat.h"
#include "core/scan/position_file.h"

namespace atlas {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxPartials = 100;  // that others left

static_assert(std::endian::native == std::endian::little, "scans are little-endian float32");
static_assert(sizeof(SimulatedPoint) == 16, "a point in velodyne/*.bin is four float32");

struct FileCloser {
  void operator()(std::FILE* file) const { static_cast<void>(std::fclose(file)); }
};

// Its errors are told by Open, Write and Close, each once.
class OutputFile {
 public:
  Status Open(const fs::path& path) {
    path_ = path;
    file_.reset(std::fopen(path.c_str(), "wb"));
    return file_ ? Status() : DiskError("cannot create", path, errno);
  }
  Status Write(const void* bytes, std::size_t size) {
    const bool is_written = size == 0 || std::fwrite(bytes, 1, size, file_.get()) == size;
    return is_written ? Status() : DiskError("cannot write", path_, errno);
  }
  Status Close() {
    return std::fclose(file_.release()) == 0 ? Status() : DiskError("cannot write", path_, errno);
  }

 private:
  fs::path path_;
  std::unique_ptr<std::FILE, FileCloser> file_;
};

Status WriteFile(const fs::path& path, const void* bytes, std::size_t size) {
  OutputFile file;
  ATLAS_RETURN_IF_ERROR(file.Open(path));
  ATLAS_RETURN_IF_ERROR(file.Write(bytes, size));
  return file.Close();
}

std::string Numbered(std::size_t i, const char* extension) {
  std::string digits = std::to_string(i);
  digits.insert(0, digits.size() < 6 ? 6 - digits.size() : 0, '0');
  return digits + extension;
}

Status WriteScan(const SimulatedScan& scan, std::size_t i, const fs::path& folder) {
  ATLAS_RETURN_IF_ERROR(WriteFile(folder / "velodyne" / Numbered(i, ".bin"), scan.points.data(),
                                  scan.points.size() * sizeof(SimulatedPoint)));
  return WriteFile(folder / "labels" / Numbered(i, ".label"), scan.labels.data(),
                   scan.labels.size() * sizeof(std::uint32_t));
}

void AppendNumber(double value, std::string_view end, std::string& text) {
  std::array<char, 32> digits{};
  const int size = std::snprintf(digits.data(), digits.size(), "%.12g", value);
  text.append(digits.data(), static_cast<std::size_t>(size)).append(end);
}

// "scan class", 12 numbers of T_world_box, three of the size.
void AppendBox(const std::string& scan, const TruthBox& box, std::string& text) {
  text.append(scan).append(" ").append(std::to_string(box.label & 0xFFFF)).append(" ");
  for (const double number : PoseToRowMajor(box.T_world_box)) {
    AppendNumber(number, " ", text);
  }
  AppendNumber(box.size_m.x(), " ", text);
  AppendNumber(box.size_m.y(), " ", text);
  AppendNumber(box.size_m.z(), "\n", text);
}

Status WriteBoxes(const std::string& scan, const std::vector<TruthBox>& boxes, OutputFile& file) {
  std::string text;
  for (const TruthBox& box : boxes) {
    AppendBox(scan, box, text);
  }
  return file.Write(text.data(), text.size());
}

std::size_t EndOf(const SimulatedDrive& drive, const DriveWriteOptions& options) {
  return std::min(drive.scans(), options.end);
}

Status WritePoses(const std::vector<Pose>& poses, const fs::path& file) {
  std::string text;
  for (const Pose& pose : poses) {
    const std::array<double, 12> numbers = PoseToRowMajor(pose);
    for (std::size_t n = 0; n < numbers.size(); ++n) {
      AppendNumber(numbers[n], n + 1 < numbers.size() ? " " : "\n", text);
    }
  }
  return WriteFile(file, text.data(), text.size());
}

Status WriteText(const SimulatedDrive& drive,
                 const DriveWriteOptions& options,
                 const fs::path& folder) {
  std::vector<Pose> poses;
  std::vector<double> times_s;
  std::string times;
  for (std::size_t i = options.begin; i < EndOf(drive, options); ++i) {
    poses.push_back(drive.sensor_pose(i));
    times_s.push_back(drive.time_s(i));
    AppendNumber(times_s.back(), "\n", times);
  }
  ATLAS_RETURN_IF_ERROR(WriteFile(folder / "times.txt", times.data(), times.size()));
  if (options.gnss) {
    const std::string text = PositionFileText(MeasuredPlaces(poses, times_s, *options.gnss));
    ATLAS_RETURN_IF_ERROR(WriteFile(folder / "positions.txt", text.data(), text.size()));
  }
  if (options.drift) {
    ATLAS_RETURN_IF_ERROR(WritePoses(poses, folder / "truth.txt"));
    poses = Drifted(poses, *options.drift);
  }
  return WritePoses(poses, folder / "poses.txt");
}

Status MakeFolder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  return error ? DiskError("cannot create folder", path, error.value()) : Status();
}

Status WriteInto(const SimulatedDrive& drive,
                 const fs::path& folder,
                 const DriveWriteOptions& options,
                 const DriveProgress& progress) {
  ATLAS_RETURN_IF_ERROR(MakeFolder(folder / "velodyne"));
  ATLAS_RETURN_IF_ERROR(MakeFolder(folder / "labels"));
  OutputFile boxes;
  ATLAS_RETURN_IF_ERROR(boxes.Open(folder / "boxes.txt"));
  ATLAS_RETURN_IF_ERROR(WriteBoxes("all", drive.parked_boxes(), boxes));
  for (std::size_t i = options.begin; i < EndOf(drive, options); ++i) {
    const SimulatedScan scan = drive.Scan(i);
    const std::size_t number = i - options.begin;
    if (scan.points.empty()) {
      return Status(StatusCode::kInvalidData,
                    StrCat("scan ", i, " sees nothing: does the drive lead through the world?"));
    }
    ATLAS_RETURN_IF_ERROR(WriteScan(scan, number, folder));
    ATLAS_RETURN_IF_ERROR(WriteBoxes(std::to_string(number), drive.moving_boxes(i), boxes));
    if (progress) {
      ATLAS_RETURN_IF_ERROR(progress(number + 1));
    }
  }
  ATLAS_RETURN_IF_ERROR(boxes.Close());
  ATLAS_RETURN_IF_ERROR(WriteText(drive, options, folder));
  return progress ? progress(EndOf(drive, options) - options.begin) : Status();
}

Status CheckTarget(const fs::path& folder) {
  std::error_code error;
  const fs::file_status status = fs::status(folder, error);
  if (status.type() == fs::file_type::not_found) {
    return {};
  }
  if (error) {
    return DiskError("cannot look at", folder, error.value());
  }
  const bool is_empty_folder =
      status.type() == fs::file_type::directory && fs::is_empty(folder, error);
  if (error) {
    return DiskError("cannot look into", folder, error.value());
  }
  return is_empty_folder ? Status()
                         : Status(StatusCode::kConflict,
                                  StrCat("folder ", folder.string(),
                                         " exists and is not empty, expected a new one"));
}

// A new folder beside `target`, which nobody else has.
Status MakePartial(const fs::path& target, fs::path& partial) {
  std::error_code error;
  if (target.has_parent_path()) {
    fs::create_directories(target.parent_path(), error);
  }
  if (error) {
    return DiskError("cannot create folder", target, error.value());
  }
  for (int i = 0; i < kMaxPartials; ++i) {
    partial = target;
    partial += i == 0 ? ".partial" : StrCat(".partial", i);
    if (fs::create_directory(partial, error)) {
      return {};
    }
    if (error && error != std::errc::file_exists) {
      return DiskError("cannot create folder", partial, error.value());
    }
  }
  return {StatusCode::kConflict,
          StrCat(partial.string(), " exists, and all before it: remove what others left")};
}

// A folder that goes with it, unless it got its name.
class UnfinishedFolder {
 public:
  explicit UnfinishedFolder(const fs::path& folder) : folder_(folder) {}
  UnfinishedFolder(const UnfinishedFolder&) = delete;
  UnfinishedFolder& operator=(const UnfinishedFolder&) = delete;
  ~UnfinishedFolder() {
    if (!is_named_) {
      std::error_code ignored;  // the first error is the one to tell
      fs::remove_all(folder_, ignored);
    }
  }

  Status Name(const fs::path& target) {
    std::error_code error;
    fs::rename(folder_, target, error);
    is_named_ = !error;
    return error ? DiskError("cannot create folder", target, error.value()) : Status();
  }

 private:
  const fs::path& folder_;
  bool is_named_ = false;
};

}  // namespace

Status DriveWriteOptions::Validate(const SimulatedDrive& drive) const {
  if (begin >= std::min(end, drive.scans())) {
    return {StatusCode::kInvalidArgument,
            StrCat("scans ", begin, ":", end, ": none of the drive's ", drive.scans())};
  }
  if (gnss) ATLAS_RETURN_IF_ERROR(gnss->Validate());
  return drift ? drift->Validate() : Status();
}

Status WriteDrive(const SimulatedDrive& drive,
                  const fs::path& folder,
                  const DriveProgress& progress,
                  const DriveWriteOptions& options) {
  ATLAS_RETURN_IF_ERROR(options.Validate(drive));
  ATLAS_RETURN_IF_ERROR(CheckTarget(folder));
  // "a/b/" and "a/b" are the same folder.
  const fs::path target = folder.has_filename() ? folder : folder.parent_path();
  fs::path partial;
  ATLAS_RETURN_IF_ERROR(MakePartial(target, partial));
  UnfinishedFolder unfinished(partial);
  ATLAS_RETURN_IF_ERROR(WriteInto(drive, partial, options, progress));
  return unfinished.Name(target);
}

}  // namespace atlas
