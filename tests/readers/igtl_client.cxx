// igtl_client PORT X Y Z: a client of the C++ library of OpenIGTLink, every CRC checked.
//
// Sends poses of the applicator about X Y Z (its shaft from the front, LPS, mm) and asks for what a viewer wants. One line of
// JSON for each answer that was asked for; anything that cannot be unpacked ends it with 1.

#include <igtlCapabilityMessage.h>
#include <igtlClientSocket.h>
#include <igtlImageMessage.h>
#include <igtlPointMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlStatusMessage.h>
#include <igtlTimeStamp.h>
#include <igtlTransformMessage.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <list>
#include <string>

namespace {

constexpr int kCheckCrc = 1;
// What is waited for comes within a second, and much later where the machine has other work.
constexpr int kPatienceMs = 120000;
constexpr unsigned kMostPoses = 1000;
constexpr unsigned kEpoch = 1700000000u;

[[noreturn]] void fail(const std::string& why) {
  std::fprintf(stderr, "igtl_client: %s\n", why.c_str());
  std::exit(1);
}

class Peer {
 public:
  explicit Peer(int port) : socket_(igtl::ClientSocket::New()) {
    if (socket_->ConnectToServer("127.0.0.1", port) != 0) fail("no connection");
    socket_->SetReceiveTimeout(kPatienceMs);
  }

  void send(igtl::MessageBase* message) {
    message->Pack();
    if (!socket_->Send(message->GetPackPointer(), message->GetPackSize())) fail("cannot send");
  }

  // The next header of this type; all others are passed over: the session says something each second.
  igtl::MessageHeader::Pointer until(const std::string& type) {
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::milliseconds(kPatienceMs);
    for (;;) {
      if (Clock::now() > end) fail("no " + type + " came in time");
      auto header = igtl::MessageHeader::New();
      header->InitPack();
      const int size = header->GetPackSize();
      if (socket_->Receive(header->GetPackPointer(), size) != size) fail("no " + type + " came");
      header->Unpack();
      if (type == header->GetDeviceType()) return header;
      socket_->Skip(header->GetBodySizeToRead(), 0);
    }
  }

  template <class Message>
  typename Message::Pointer body(igtl::MessageHeader::Pointer header) {
    auto message = Message::New();
    message->SetMessageHeader(header);
    message->AllocatePack();
    const int size = message->GetPackBodySize();
    if (socket_->Receive(message->GetPackBodyPointer(), size) != size) fail("a body is cut");
    if (!(message->Unpack(kCheckCrc) & igtl::MessageHeader::UNPACK_BODY)) {
      fail(std::string(header->GetDeviceType()) + " cannot be unpacked");
    }
    return message;
  }

  template <class Message>
  typename Message::Pointer next(const std::string& type) {
    return body<Message>(until(type));
  }

 private:
  igtl::ClientSocket::Pointer socket_;
};

igtl::TimeStamp::Pointer stamp(unsigned number) {
  auto stamp = igtl::TimeStamp::New();
  stamp->SetTime(kEpoch + number / 4, (number % 4) * 250000000u);
  return stamp;
}

void send_pose(Peer& peer, unsigned number, const float (&at)[3]) {
  igtl::Matrix4x4 pose = {{1, 0, 0, at[0]}, {0, 0, 1, at[1]}, {0, -1, 0, at[2]}, {0, 0, 0, 1}};
  auto message = igtl::TransformMessage::New();
  message->SetDeviceName("Applicator");
  auto when = stamp(number);
  message->SetTimeStamp(when);
  message->SetMatrix(pose);
  peer.send(message);
}

// The point with the stamp of a pose, once the tissue has come to rest; false where it was stale before it was read.
bool answer(Peer& peer, unsigned number) {
  for (;;) {
    auto message = peer.next<igtl::PointMessage>("POINT");
    auto when = igtl::TimeStamp::New();
    message->GetTimeStamp(when);
    const double off = when->GetTimeStamp() - stamp(number)->GetTimeStamp();
    if (message->GetNumberOfPointElement() != 1) fail("a POINT without its point");
    igtl::PointElement::Pointer point;
    message->GetPointElement(0, point);
    const std::string state = point->GetGroupName();
    if (std::fabs(off) > 1e-6 || state == "predicted") continue;
    if (state != "ok") return false;
    float at[3];
    point->GetPosition(at);
    std::printf(
        "{\"type\":\"POINT\",\"device\":\"%s\",\"number\":%u,\"at\":[%.6f,%.6f,%.6f],"
        "\"diameter\":%.4f,\"owner\":\"%s\"}\n",
        message->GetDeviceName(), number, at[0], at[1], at[2], point->GetRadius(), point->GetOwner());
    return true;
  }
}

void tell_capability(Peer& peer) {
  peer.send(igtl::GetCapabilityMessage::New());
  auto message = peer.next<igtl::CapabilityMessage>("CAPABILITY");
  std::printf("{\"type\":\"CAPABILITY\",\"types\":[");
  for (int n = 0; n < message->GetNumberOfTypes(); ++n) {
    std::printf("%s\"%s\"", n == 0 ? "" : ",", message->GetType(n));
  }
  std::printf("]}\n");
}

void tell_status(Peer& peer) {
  auto get = igtl::GetStatusMessage::New();
  peer.send(get);
  auto message = peer.next<igtl::StatusMessage>("STATUS");
  // The stamps here are no clock's: the session says so, at times after the last answer.
  while (std::string(message->GetErrorName()) == "ClockSet") {
    message = peer.next<igtl::StatusMessage>("STATUS");
  }
  std::printf("{\"type\":\"STATUS\",\"code\":%d,\"name\":\"%s\",\"text\":\"%s\"}\n", message->GetCode(),
              message->GetErrorName(), message->GetStatusString());
}

void tell_surface(igtl::PolyDataMessage::Pointer message) {
  auto points = message->GetPoints();
  auto cells = message->GetPolygons();
  const int n_points = points->GetNumberOfPoints();
  const float far = std::numeric_limits<float>::max();
  float low[3] = {far, far, far}, high[3] = {-far, -far, -far};
  for (int n = 0; n < n_points; ++n) {
    float at[3];
    points->GetPoint(n, at);
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], at[axis]);
      high[axis] = std::max(high[axis], at[axis]);
    }
  }
  unsigned triangles = 0, largest = 0;
  for (unsigned n = 0; n < cells->GetNumberOfCells(); ++n) {
    std::list<igtlUint32> cell;
    cells->GetCell(n, cell);
    triangles += cell.size() == 3;
    for (unsigned index : cell) largest = std::max(largest, index);
  }
  if (message->GetNumberOfAttributes() != 1) fail("a surface without its one attribute");
  auto attribute = message->GetAttribute(0);
  std::printf(
      "{\"type\":\"POLYDATA\",\"points\":%d,\"triangles\":%u,\"cells\":%u,\"largest_index\":%u,"
      "\"low\":[%.3f,%.3f,%.3f],\"high\":[%.3f,%.3f,%.3f],\"attribute\":\"%s\",\"values\":%u}\n",
      n_points, triangles, cells->GetNumberOfCells(), largest, low[0], low[1], low[2], high[0], high[1],
      high[2], attribute->GetName(), attribute->GetSize());
}

void tell_image(Peer& peer) {
  peer.send(igtl::GetImageMessage::New());
  auto image = peer.next<igtl::ImageMessage>("IMAGE");
  int size[3];
  float spacing[3], centre[3];
  igtl::Matrix4x4 matrix;
  image->GetDimensions(size);
  image->GetSpacing(spacing);
  image->GetOrigin(centre);
  image->GetMatrix(matrix);
  if (image->GetScalarType() != igtl::ImageMessage::TYPE_INT16) fail("an IMAGE of other numbers");
  if (image->GetEndian() != igtl::ImageMessage::ENDIAN_LITTLE) fail("an IMAGE of other byte order");
  const long count = 1L * size[0] * size[1] * size[2];
  if (image->GetImageSize() != count * 2) fail("an IMAGE of another size");
  const auto* bytes = static_cast<const unsigned char*>(image->GetScalarPointer());
  int low = 32767, high = -32768;
  for (long n = 0; n < count; ++n) {
    const int value = static_cast<short>(bytes[2 * n] | bytes[2 * n + 1] << 8);
    low = std::min(low, value);
    high = std::max(high, value);
  }
  std::printf(
      "{\"type\":\"IMAGE\",\"size\":[%d,%d,%d],\"spacing\":[%g,%g,%g],\"centre\":[%.3f,%.3f,%.3f],"
      "\"diagonal\":[%g,%g,%g],\"frame\":%d,\"hu\":[%d,%d]}\n",
      size[0], size[1], size[2], spacing[0], spacing[1], spacing[2], centre[0], centre[1], centre[2],
      matrix[0][0], matrix[1][1], matrix[2][2], image->GetCoordinateSystem(), low, high);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) fail("PORT X Y Z");
  Peer peer(std::atoi(argv[1]));
  float at[3];
  for (int axis = 0; axis < 3; ++axis) at[axis] = std::strtof(argv[2 + axis], nullptr);
  tell_capability(peer);
  unsigned number = 0;
  for (unsigned step = 1; step <= 5; ++step) {
    const float shift = 0.5f * step;
    // Where the machine has other work an answer may be stale before it is read: then the pose is sent again, 1 um aside, for
    // those that are equal are not followed.
    do {
      if (++number > kMostPoses) fail("no answer is good");
      const float aside = 0.001f * number;
      send_pose(peer, number, {at[0] + shift + aside, at[1] + 0.5f * shift, at[2] - shift});
    } while (!answer(peer, number));
  }
  tell_status(peer);
  peer.send(igtl::GetPolyDataMessage::New());
  tell_surface(peer.next<igtl::PolyDataMessage>("POLYDATA"));
  tell_image(peer);
  return 0;
}
