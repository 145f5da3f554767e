"""Client against mock, step by step: hypothesis decides what is carried, lost, doubled, torn, and who else writes.

The radio here is two queues of frames, and every frame's fate is a rule. Whatever comes of it, outcomes are typed and
in time, and what is called verified is what the vehicle held when it sent a frame that tells so and that arrived: the
last item of the list, the count of an empty one, or PX4's own id of it.
"""

import random
from collections import deque
from dataclasses import dataclass

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from benchmarks.transfer_case import LISTS, Lists
from benchmarks.transfer_oracle import HOME, Sample, make_sample
from mavplan.errors import MavplanError
from mavplan.link.clear_session import ClearSession
from mavplan.link.codec import Codec
from mavplan.link.download_session import DownloadSession
from mavplan.link.protocol import Address, Message, mission_clear_all, mission_count, mission_item
from mavplan.link.session import Session
from mavplan.link.upload_session import UploadSession
from mavplan.link.verify_session import VerifySession
from mavplan.mission.autopilots import AUTOPILOTS
from mavplan.mission.uploadable import lists_to_send
from sitl_mock.autopilot import Autopilot
from sitl_mock.firmware import FIRMWARES

OURS, THEIRS = "ours", "theirs"
VEHICLE, STRANGER = Address(1, 1), Address(201, 190)
DEADLINE_S = 60.0
STEPS = 20_000


@dataclass
class Falling:
    """A frame on its way down, and what the vehicle held when it sent it."""

    frame: bytes
    held: Lists


class Transfers(RuleBasedStateMachine):
    """One vehicle, one session at a time, and a radio that does what it likes."""

    @initialize(
        firmware=st.sampled_from(["ardupilot", "px4"]), seed=st.integers(0, 99), items=st.integers(3, 7)
    )
    def switch_on(self, firmware, seed, items):
        chance = random.Random(seed)
        self.firmware, self.now, self.session = firmware, 100.0, None
        self.samples: list[Sample] = [make_sample(firmware, items + more, chance) for more in (0, 0, 2)]
        place = (HOME.lat_e7 / 1e7, HOME.lon_e7 / 1e7, HOME.alt_amsl_m)
        self.vehicle = Autopilot(FIRMWARES[firmware], home=place)
        self.up: deque[bytes] = deque()
        self.down: deque[Falling] = deque()
        self.told: list[Lists] = []
        self.wanted = self.samples[0]
        self.codec, self.stranger = Codec(), Codec(STRANGER)

    # -- the machinery ----------------------------------------------------------------------------------------

    def held(self) -> Lists:
        return {kind: self.vehicle.stored(kind) for kind in LISTS}

    def move(self) -> None:
        """Take what both sides want to send."""
        if self.session is not None:
            self.session.tick(self.now)
            self.up += [self.codec.encode(message) for message in self.session.to_send()]
        self.vehicle.tick(self.now)
        for link, frame in self.vehicle.to_send():
            if link != THEIRS:
                self.down.append(Falling(frame, self.held()))

    def land(self, falling: Falling) -> None:
        """Let a frame arrive at the session."""
        for message in self.codec.decode(falling.frame, self.now):
            if self.session is not None and not self.session.done:
                if message.get_type() in {"MISSION_ITEM_INT", "MISSION_COUNT", "MISSION_CURRENT"}:
                    self.told.append(falling.held)
                self.session.receive(message, self.now)

    def wait(self, seconds: float) -> None:
        """Let time pass, through everybody's timers."""
        until = self.now + seconds
        for _ in range(STEPS):
            self.move()
            ahead = [
                self.vehicle.next_timer(),
                self.session.next_timer() if self.session is not None else None,
            ]
            timer = min((at for at in ahead if at is not None), default=until)
            if timer >= until:
                break
            self.now = max(timer, self.now + 1e-6)
        else:
            raise AssertionError("somebody asks for time but does not move")
        self.now = until
        self.move()

    def carry_all(self) -> None:
        """Carry everything that is on its way."""
        while self.up or self.down:
            while self.up:
                self.vehicle.receive(self.up.popleft(), OURS, self.now)
                self.move()
            while self.down:
                self.land(self.down.popleft())
                self.move()

    # -- what the user does -----------------------------------------------------------------------------------

    def begin(self, session: Session) -> None:
        self.session, self.told = session, []
        self.codec = Codec(session.us)
        self.move()

    def idle(self) -> bool:
        return self.session is None

    def busy(self) -> bool:
        return self.session is not None

    @precondition(idle)
    @rule(which=st.integers(0, 2))
    def upload(self, which):
        self.wanted = self.samples[which]
        self.begin(UploadSession(self.wanted.mission, now=self.now, deadline_s=DEADLINE_S))

    @precondition(idle)
    @rule(which=st.integers(0, 2))
    def verify(self, which):
        self.wanted = self.samples[which]
        self.begin(VerifySession(self.wanted.mission, now=self.now, deadline_s=DEADLINE_S))

    @precondition(idle)
    @rule()
    def download(self):
        self.begin(DownloadSession(now=self.now, deadline_s=DEADLINE_S))

    @precondition(idle)
    @rule(kinds=st.sampled_from([(0,), (0, 1, 2)]))
    def clear(self, kinds):
        self.begin(ClearSession(kinds, now=self.now, deadline_s=DEADLINE_S))

    # -- what the radio does ----------------------------------------------------------------------------------

    @precondition(busy)
    @rule(rounds=st.integers(1, 12), wait_s=st.sampled_from([0.0, 0.01, 0.3]))
    def carry(self, rounds, wait_s):
        for _ in range(rounds):
            self.carry_all()
            self.wait(wait_s)

    @rule(count=st.integers(1, 3))
    def carry_a_little(self, count):
        for _ in range(count):
            if self.up:
                self.vehicle.receive(self.up.popleft(), OURS, self.now)
                self.move()
            if self.down:
                self.land(self.down.popleft())
                self.move()

    @rule(upwards=st.booleans(), count=st.integers(1, 4))
    def lose(self, upwards, count):
        queue = self.up if upwards else self.down
        for _ in range(min(count, len(queue))):
            queue.popleft()

    @rule(upwards=st.booleans())
    def double(self, upwards):
        queue = self.up if upwards else self.down
        if queue:
            queue.append(queue[0])

    @rule(upwards=st.booleans(), by=st.integers(-3, 3))
    def overtake(self, upwards, by):
        (self.up if upwards else self.down).rotate(by)

    @rule(at=st.integers(0, 60), bits=st.integers(1, 255))
    def spoil(self, at, bits):
        if self.down:
            falling = self.down.popleft()
            torn = bytearray(falling.frame)
            torn[at % len(torn)] ^= bits
            self.down.appendleft(Falling(bytes(torn), falling.held))
        if self.up:
            torn = bytearray(self.up.popleft())
            torn[at % len(torn)] ^= bits
            self.up.appendleft(bytes(torn))

    @rule(seconds=st.sampled_from([0.05, 0.3, 1.1, 6.0, 9.0]))
    def silence(self, seconds):
        self.wait(seconds)

    # -- what others do ---------------------------------------------------------------------------------------

    @rule()
    def reboot(self):
        self.vehicle.reboot(self.now)
        self.move()

    def say(self, message: Message) -> None:
        """Let another station say something on the shared radio, where our session hears it too."""
        frame = self.stranger.encode(message)
        held = self.held()
        self.vehicle.receive(frame, THEIRS, self.now)
        self.vehicle.tick(self.now)
        self.vehicle.to_send()
        self.land(Falling(frame, held))

    @rule(which=st.integers(0, 2))
    def another_station_uploads(self, which):
        items = lists_to_send(self.samples[which].mission, AUTOPILOTS[self.firmware])[0]
        self.move()
        self.say(mission_count(VEHICLE, len(items), 0))
        for item in items:
            self.say(mission_item(VEHICLE, item, 0))

    @rule()
    def another_station_clears(self):
        self.move()
        self.say(mission_clear_all(VEHICLE, 0))

    # -- what must hold ---------------------------------------------------------------------------------------

    @invariant()
    def outcomes_are_true_typed_and_in_time(self):
        session = getattr(self, "session", None)
        if session is None:
            return
        assert session.done or self.now <= session.started_at + DEADLINE_S + 1e-3
        if not session.done:
            return
        self.session = None
        if session.error is not None:
            assert isinstance(session.error, MavplanError)
            assert str(session.error)
            assert "\n" not in str(session.error)
            return
        told = [*self.told, self.held()]
        if isinstance(session, ClearSession):
            assert any(len(held[0]) <= (self.firmware == "ardupilot") for held in told)
        elif isinstance(session, DownloadSession):
            home = int(self.firmware == "ardupilot")
            assert any(len(held[0]) - home == len(session.mission.items) for held in told)
        else:
            assert any(self.wanted.is_held(held[0]) for held in told)

    def teardown(self):
        """On a good radio every session comes to its end."""
        if getattr(self, "session", None) is None:
            return
        for _ in range(int(DEADLINE_S / 0.05) + 2):
            self.carry_all()
            self.outcomes_are_true_typed_and_in_time()
            if self.session is None:
                return
            self.wait(0.05)
        raise AssertionError("the session outlived its deadline")


Transfers.TestCase.settings = settings(
    max_examples=200,
    stateful_step_count=40,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
TestTransfers = Transfers.TestCase
