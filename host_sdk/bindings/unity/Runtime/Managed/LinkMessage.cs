// A host's requests and the probe's responses: messages of proto/lightwell/v1/link_message.proto, as far as this client
// uses them.
using System.Text;

namespace Lightwell.Managed
{
    internal static class LinkRequest
    {
        internal static byte[] Info(uint id) => new WireWriter().Fixed32(1, id).Message(2, new byte[0]).ToArray();

        internal static byte[] Authenticate(uint id, string token) =>
            new WireWriter().Fixed32(1, id).Message(6, new WireWriter().Text(1, token).ToArray()).ToArray();
    }

    /// <summary>A LinkResponse.</summary>
    internal sealed class LinkResponse
    {
        internal const int MaxBytes = 8192;
        /// <summary>First byte of a response, and of no descriptor.</summary>
        internal const byte Tag = 0x0d;

        internal uint Id;
        /// <summary>0: the probe executed the request.</summary>
        internal uint Code;
        internal string Text = "";
        internal bool HasInfo;
        internal string Name = "", Version = "", Camera = "";
        internal long ClockNow;

        /// <summary>Throws DecodeException for bytes that are no LinkResponse.</summary>
        internal static LinkResponse Decode(byte[] bytes, int count)
        {
            if (count > MaxBytes) throw new DecodeException(Status.DataLoss, "response: longer than 8 KiB");
            var made = new LinkResponse();
            var wire = new WireReader(bytes, count, "response");
            while (wire.Next(out var field))
                switch (field)
                {
                    case 1: wire.Fixed32(ref made.Id); break;
                    case 2: wire.UInt32(ref made.Code); break;
                    case 3: wire.Text(ref made.Text); break;
                    case 4: if (wire.Message(out var part)) made.ReadInfo(part); break;
                    default: wire.Skip(); break;
                }
            made.Text = Printable(made.Text);
            return made;
        }

        private void ReadInfo(WireReader wire)
        {
            HasInfo = true;
            while (wire.Next(out var field))
                switch (field)
                {
                    case 1: wire.Text(ref Name); break;
                    case 4: wire.Text(ref Version); break;
                    case 5: wire.Text(ref Camera); break;
                    case 6: wire.Fixed64(ref ClockNow); break;
                    default: wire.Skip(); break;
                }
        }

        /// <summary>Text of a peer without control characters, at most 500 characters.</summary>
        internal static string Printable(string text)
        {
            var made = new StringBuilder();
            foreach (var c in text)
            {
                if (made.Length == 500) break;
                made.Append(char.IsControl(c) || c == '\u2028' || c == '\u2029' ? '?' : c);
            }
            return made.ToString();
        }
    }
}
