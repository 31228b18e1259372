// Pictures and a service over Fast DDS, as rmw_fastrtps has them: raw bytes in, counts out as one JSON object.
//
// fast_peer DOMAIN IMAGE COUNT RATE RELIABLE: IMAGE is a file with the bytes of a sensor_msgs/Image, whose stamp is set anew.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastdds/rtps/common/WriteParams.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

using namespace eprosima::fastdds::dds;
using namespace eprosima::fastrtps::rtps;
using Bytes = std::vector<char>;
using Clock = std::chrono::steady_clock;

// A type without fields, only with a name: its samples are bytes, including the four that name the encoding.
class RawType : public TopicDataType {
 public:
  explicit RawType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 4 << 20;
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, SerializedPayload_t* payload) override {
    const Bytes& bytes = *static_cast<Bytes*>(data);
    payload->length = bytes.size();
    payload->encapsulation = CDR_LE;
    std::memcpy(payload->data, bytes.data(), bytes.size());
    return true;
  }
  bool deserialize(SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes; }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void*, InstanceHandle_t*, bool) override { return false; }
};

struct Peer {
  DomainParticipant* participant;
  Publisher* publisher;
  Subscriber* subscriber;

  explicit Peer(int domain) {
    DomainParticipantQos qos;
    auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
    transport->interfaceWhiteList.push_back("127.0.0.1");
    transport->sendBufferSize = transport->receiveBufferSize = 4 << 20;
    qos.transport().use_builtin_transports = false;
    qos.transport().user_transports.push_back(transport);
    participant = DomainParticipantFactory::get_instance()->create_participant(domain, qos);
    publisher = participant->create_publisher(PUBLISHER_QOS_DEFAULT);
    subscriber = participant->create_subscriber(SUBSCRIBER_QOS_DEFAULT);
  }
  Topic* topic(const std::string& name, const std::string& type) {
    TypeSupport support(new RawType(type));
    support.register_type(participant);
    return participant->create_topic(name, type, TOPIC_QOS_DEFAULT);
  }
  DataWriter* writer(const std::string& name, const std::string& type, bool reliable) {
    DataWriterQos qos = DATAWRITER_QOS_DEFAULT;
    qos.reliability().kind = reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 10;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    qos.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;
    return publisher->create_datawriter(topic(name, type), qos);
  }
  DataReader* reader(const std::string& name, const std::string& type) {
    DataReaderQos qos = DATAREADER_QOS_DEFAULT;
    qos.reliability().kind = RELIABLE_RELIABILITY_QOS;
    qos.history().kind = KEEP_LAST_HISTORY_QOS;
    qos.history().depth = 500;
    qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
    return subscriber->create_datareader(topic(name, type), qos);
  }
};

void stamp(Bytes& message) {
  auto now = std::chrono::system_clock::now().time_since_epoch();
  int32_t sec = std::chrono::duration_cast<std::chrono::seconds>(now).count();
  uint32_t nanos = (std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()) % 1000000000;
  std::memcpy(message.data() + 4, &sec, 4);
  std::memcpy(message.data() + 8, &nanos, 4);
}

int count(DataReader* reader, size_t min_bytes) {
  int found = 0;
  Bytes bytes;
  SampleInfo info;
  while (reader->take_next_sample(&bytes, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK)
    found += info.valid_data && bytes.size() >= min_bytes;
  return found;
}

int main(int argc, char** argv) {
  if (argc != 6) return 2;
  Peer peer(std::atoi(argv[1]));
  std::ifstream file(argv[2], std::ios::binary);
  Bytes image{std::istreambuf_iterator<char>(file), {}};
  image.insert(image.begin(), {0, 1, 0, 0});
  const int number = std::atoi(argv[3]);
  const auto period = std::chrono::duration<double>(1.0 / std::atof(argv[4]));
  DataWriter* images = peer.writer("rt/image", "sensor_msgs::msg::dds_::Image_", std::atoi(argv[5]) != 0);
  DataReader* poses = peer.reader("rt/sdg/grasp_pose", "geometry_msgs::msg::dds_::PoseStamped_");
  DataReader* detections = peer.reader("rt/sdg/detections", "vision_msgs::msg::dds_::Detection2DArray_");
  DataWriter* requests = peer.writer("rq/sdg/detect_triggerRequest", "std_srvs::srv::dds_::Trigger_Request_", true);
  DataReader* replies = peer.reader("rr/sdg/detect_triggerReply", "std_srvs::srv::dds_::Trigger_Response_");
  std::this_thread::sleep_for(std::chrono::seconds(3));

  int num_poses = 0, num_detections = 0;
  auto begun = Clock::now();
  for (int i = 0; i < number; ++i) {
    stamp(image);
    image.back() = static_cast<char>(i);
    images->write(&image);
    std::this_thread::sleep_until(begun + std::chrono::duration_cast<Clock::duration>(period * (i + 1)));
    num_poses += count(poses, 60);
    num_detections += count(detections, 60);
  }
  auto last = Clock::now();
  while (Clock::now() - last < std::chrono::seconds(60) && num_detections < number) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    int more = count(detections, 60);
    num_poses += count(poses, 60);
    num_detections += more;
    if (more > 0) last = Clock::now();
    if (Clock::now() - last > std::chrono::seconds(8)) break;
  }
  num_poses += count(poses, 60);

  // A request with one byte, and a picture for it.
  Bytes request{0, 1, 0, 0, 0};
  WriteParams params;
  auto asked = Clock::now();
  requests->write(&request, params);
  double answered_ms = -1.0;
  std::string text;
  while (Clock::now() - asked < std::chrono::seconds(10) && answered_ms < 0.0) {
    stamp(image);
    images->write(&image);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    Bytes reply;
    SampleInfo info;
    while (replies->take_next_sample(&reply, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data || info.related_sample_identity.sequence_number() != params.sample_identity().sequence_number()) continue;
      answered_ms = std::chrono::duration<double, std::milli>(Clock::now() - asked).count();
      if (reply.size() > 12) text.assign(reply.begin() + 12, reply.end());
    }
  }
  text = text.c_str();
  std::printf("{\"sent\": %d, \"detections\": %d, \"poses\": %d, \"answered_ms\": %.0f, \"answer\": \"%s\"}\n", number, num_detections,
              num_poses, answered_ms, text.c_str());
  return 0;
}
