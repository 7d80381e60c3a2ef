// poses.txt and times.txt of a recorded drive: the first byte says which.
#include "core/scan/drive_folder.h"
#include "tests/fuzz/support/fuzz_target.h"
#include "tests/fuzz/support/scratch_folder.h"

namespace atlas::fuzz {
namespace {

constexpr std::string_view kIdentity = "1 0 0 0 0 1 0 0 0 0 1 0\n";

std::vector<Bytes> Seeds() {
  return {BytesOf("p1 0 0 1.5 0 1 0 -2e3 0 0 1 0.25\n"),
          BytesOf("p0 -1 0 9999999 1 0 0 -1e7 0 0 1 19999\r\n1 0 0 0 0 1 0 0 0 0 1 0\n"),
          BytesOf("t0.000000e+00\n"), BytesOf("t1700000000.25\n1.7e9\n")};
}

// A drive of one scan, whose other files are as they should be.
class Drive {
 public:
  Drive() {
    std::filesystem::create_directory(folder_.path() / "velodyne");
    folder_.Write("velodyne/000000.bin", {});
  }

  bool OpenWith(std::string_view poses, std::string_view times) {
    folder_.Write("times.txt", BytesOf(times));
    const auto path = folder_.Write("poses.txt", BytesOf(poses));
    const auto read = ReadPoses(path);
    const auto drive = OpenDriveFolder(folder_.path());
    for (const Pose& pose : read ? *read : std::vector<Pose>()) {
      const QuantizedPose quantized = QuantizedPose::FromPose(pose);
      Require(quantized.Validate().ok(), "a pose that is read is one that is accepted");
    }
    Require(!drive || read.has_value(), "a drive has poses");
    return drive.has_value();
  }

 private:
  ScratchFolder folder_;
};

bool Run(ByteSpan input) {
  static Drive drive;
  if (input.empty()) {
    return false;
  }
  const std::string_view text = TextOf(input.subspan(1));
  return input[0] == 't' ? drive.OpenWith(kIdentity, text) : drive.OpenWith(text, "0\n");
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
