// What the operations port shows under a path.
#pragma once

#include <functional>
#include <string>

namespace atlas {

struct HttpReply {
  unsigned status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
};

struct HttpPage {
  std::string path;
  // May block: called on a thread of this page alone, one call at a time.
  std::function<HttpReply()> make;
};

}  // namespace atlas
