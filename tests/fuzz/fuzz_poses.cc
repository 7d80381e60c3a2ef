// poses.txt and times.txt of a recorded drive, and positions of its scans: the first byte says
// which.
#include "core/scan/drive_folder.h"
#include "core/scan/position_file.h"
#include "tests/fuzz/support/fuzz_target.h"
#include "tests/fuzz/support/scratch_folder.h"

namespace atlas::fuzz {
namespace {

constexpr std::string_view kIdentity = "1 0 0 0 0 1 0 0 0 0 1 0\n";

std::vector<Bytes> Seeds() {
  return {BytesOf("p1 0 0 1.5 0 1 0 -2e3 0 0 1 0.25\n"),
          BytesOf("p0 -1 0 9999999 1 0 0 -1e7 0 0 1 19999\r\n1 0 0 0 0 1 0 0 0 0 1 0\n"),
          BytesOf("t0.000000e+00\n"),
          BytesOf("t1700000000.25\n1.7e9\n"),
          BytesOf("g# scan x y z radius\n0 1.5 -2e3 0.25 0.5\n"),
          BytesOf("g0 -1e7 1e7 0 1e5\r\n1 0 0 0 0.001\n")};
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

  bool ReadPositionsOf(std::string_view positions) {
    folder_.Write("velodyne/000001.bin", {});
    folder_.Write("poses.txt", BytesOf("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n"));
    folder_.Write("times.txt", BytesOf("0\n0.1\n"));
    const auto drive = OpenDriveFolder(folder_.path());
    std::filesystem::remove(folder_.path() / "velodyne/000001.bin");
    Require(drive.has_value(), "a drive of two scans is opened");
    const auto places = ReadPositions(folder_.Write("gnss.txt", BytesOf(positions)), *drive);
    if (!places) return false;
    const auto again =
        ReadPositions(folder_.Write("again.txt", BytesOf(PositionFileText(*places))), *drive);
    Require(again && again->size() == places->size(), "positions that are written are read");
    for (const auto& [scan, place] : *places) {
      Require(again->contains(scan) &&
                  (again->at(scan).p_world - place.p_world).cwiseAbs().maxCoeff() <= 1e-4,
              "to a tenth of a millimetre");
    }
    return true;
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
  switch (input[0]) {
    case 't':
      return drive.OpenWith(kIdentity, text);
    case 'g':
      return drive.ReadPositionsOf(text);
    default:
      return drive.OpenWith(text, "0\n");
  }
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
