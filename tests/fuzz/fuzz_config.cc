// The daemon's TOML file, down to the map profile of a new atlas.
#include <array>
#include <string>

#include "server/config/daemon_command.h"
#include "tests/fuzz/support/fuzz_target.h"
#include "tests/fuzz/support/scratch_folder.h"

namespace atlas::fuzz {
namespace {

std::vector<Bytes> Seeds() {
  return {
      BytesOf("data = '/x'\n"),
      BytesOf(
          "# a city\ndata = \"/x\"\nlisten = \"[::1]:7448\"\nworkers = 3\nhttp = 'localhost:9100'\n"
          "log_level = 'warning'\n[map]\ncell_size = 0.2\nsegments = 16\nsegment_height = 5e-1\n"
          "preset = 'bounded'\n[limits]\nconnections_per_name = 0x10\nrequests_per_s_per_name = "
          "1_000\n"),
      BytesOf("data = '''/x\ny'''\nmap.cell_size = 1\nworkers = 0b11\n")};
}

bool Run(ByteSpan text) {
  static const ScratchFolder kFolder;
  const std::string path = kFolder.Write("atlasd.toml", text).string();
  const std::array<const char*, 3> arguments{"atlasd", "--config", path.c_str()};
  const auto command = ParseDaemonCommand(static_cast<int>(arguments.size()), arguments.data());
  if (!command) {
    return false;
  }
  if (const auto profile = command->config.NewProfile()) {
    Require(profile->Validate().ok(), "a new atlas has a profile that is one");
  }
  return true;
}

}  // namespace

const Target kTarget{&Seeds, &Run, &MutatePlain};

}  // namespace atlas::fuzz
