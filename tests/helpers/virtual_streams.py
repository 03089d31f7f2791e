"""Streams that exchange stamped chunks in one process, at whatever pace a test likes."""

import numpy as np

from hrcneuro.live.transport import Description, Lost, Samples


def xml_of(name, kind, n, sfreq, channel_format, labels, units, source_id):
    channels = "".join(
        f"<channel><label>{label}</label><unit>{unit}</unit><type>{kind}</type></channel>"
        for label, unit in zip(labels, units, strict=True)
    )
    return (
        f'<?xml version="1.0"?><info><name>{name}</name><type>{kind}</type><channel_count>{n}</channel_count>'
        f"<channel_format>{channel_format}</channel_format><source_id>{source_id}</source_id>"
        f"<nominal_srate>{sfreq}</nominal_srate><version>1.1</version><hostname>lab</hostname><desc><channels>{channels}"
        "</channels></desc></info>"
    )


class Sender:
    """A stream: what is pushed lies there until an inlet pulls it."""

    runs = 0

    def __init__(self, name="amp", kind="EEG", labels=("a", "b"), sfreq=100.0, unit="microvolts", source_id="one"):
        Sender.runs += 1
        texts = kind == "Markers"
        labels = ("marker",) if texts else labels
        units = ("",) * len(labels) if texts else (unit,) * len(labels)
        form = "string" if texts else "float32"
        sfreq = 0.0 if texts else sfreq
        xml = xml_of(name, kind, len(labels), sfreq, form, labels, units, source_id)
        self.description = Description(
            name, kind, form, sfreq, len(labels), labels, units, source_id, f"run{Sender.runs}", xml,
            xml.replace("<hostname>lab</hostname>", ""), self,
        )  # fmt: skip
        self.there, self.inlets, self.offset, self.connects = True, [], 0.0, True

    def push(self, stamps, values):
        for inlet in self.inlets:
            inlet.waiting.append((np.asarray(stamps, float), values))

    def end(self):
        self.there = False


class VirtualInlet:
    def __init__(self, network, sender):
        self.network, self.sender, self.waiting = network, sender, []
        self.description = sender.description
        sender.inlets.append(self)
        self._measured = float("-inf")

    def pull(self):
        waiting, self.waiting = self.waiting, []
        if not waiting:
            if not self.sender.there:
                raise Lost("its sender has ended")
            form = () if self.description.channel_format == "string" else np.zeros((0, self.description.n_channels))
            return Samples(np.zeros(0), form)
        values = [row for _, rows in waiting for row in rows]
        if self.description.channel_format != "string":
            values = np.asarray(values, np.float32)
        return Samples(np.concatenate([stamps for stamps, _ in waiting]), values)

    def offsets(self):
        now = self.network.now
        if now - self._measured < 5:
            return []
        self._measured = now
        return [(now, self.sender.offset)]

    def garbled(self):
        return 0

    def close(self):
        if self in self.sender.inlets:
            self.sender.inlets.remove(self)


class VirtualNetwork:
    """Senders, and a clock that moves when somebody waits."""

    def __init__(self, *senders, now=1000.0):
        self.senders, self.now, self.on_wait = list(senders), now, []

    def clock(self):
        return self.now

    def wait(self, seconds):
        self.now += seconds
        for act in list(self.on_wait):
            act(self.now)

    def visible(self):
        return [one.description for one in self.senders if one.there]

    def open(self, description):
        sender = description.handle
        if not sender.connects:
            raise Lost("it is seen, and no connection to it comes about within 5 s")
        return VirtualInlet(self, sender)


class Amplifier:
    """Pushes regular samples at the pace of a network's clock: channel 0 counts, the others are noise."""

    def __init__(self, network, sender, *, rate=None, scale=10.0, ahead=0.0):
        self.network, self.sender, self.scale = network, sender, scale
        self.sfreq = rate or sender.description.sfreq
        self.began, self.sent, self.skip, self.ahead = network.now, 0, set(), ahead
        self.rng = np.random.default_rng(1)
        network.on_wait.append(self)

    def __call__(self, now):
        due = int((now - self.began) * self.sfreq) - self.sent
        if due < 1 or not self.sender.there:
            return
        numbers = np.arange(self.sent, self.sent + due)
        self.sent += due
        values = self.scale * self.rng.standard_normal((due, self.sender.description.n_channels))
        if self.scale:
            values[:, 0] = numbers
        keep = np.array([n not in self.skip for n in numbers])
        stamps = self.began + self.ahead + numbers / self.sfreq
        self.sender.push(stamps[keep], values[keep])
