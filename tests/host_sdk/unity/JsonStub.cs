// UnityEngine.JsonUtility for the classes of Samples~/LightGrid: public fields that are numbers, strings, arrays of
// these or of such classes. Other keys are ignored, absent ones leave a field as it is, text that is no JSON is an
// ArgumentException: as in Unity's manual, "JSON serialization".
using System;
using System.Collections.Generic;
using System.Globalization;

namespace UnityEngine
{
    public static class JsonUtility
    {
        public static T FromJson<T>(string json)
        {
            if (string.IsNullOrEmpty(json)) return default(T);
            var reader = new Reader(json);
            var value = reader.Value();
            reader.End();
            return (T)ObjectOf(typeof(T), value);
        }

        private static object ObjectOf(Type type, object value)
        {
            if (value == null) return null;
            if (type.IsArray)
            {
                var list = value as List<object>;
                if (list == null) return null;
                var array = Array.CreateInstance(type.GetElementType(), list.Count);
                for (var i = 0; i < list.Count; ++i) array.SetValue(ObjectOf(type.GetElementType(), list[i]), i);
                return array;
            }
            if (type == typeof(string)) return value as string;
            if (type == typeof(int)) return (int)(double)value;
            if (type == typeof(float)) return (float)(double)value;
            var members = value as Dictionary<string, object>;
            if (members == null) throw new ArgumentException("JSON must represent an object type");
            if (!type.IsSerializable) throw new InvalidOperationException(type + " is not [Serializable]");
            var made = Activator.CreateInstance(type);
            foreach (var field in type.GetFields())
                if (members.ContainsKey(field.Name))
                    field.SetValue(made, ObjectOf(field.FieldType, members[field.Name]));
            return made;
        }

        private sealed class Reader
        {
            private readonly string text;
            private int at;

            public Reader(string text) { this.text = text; }

            public void End() { if (Next() != '\0') throw Wrong(); }

            public object Value()
            {
                switch (Next())
                {
                    case '{':
                        var members = new Dictionary<string, object>();
                        Items('}', () =>
                        {
                            if (Next() != '"') throw Wrong();
                            var name = Text();
                            if (Next() != ':') throw Wrong();
                            ++at;
                            members[name] = Value();
                        });
                        return members;
                    case '[':
                        var list = new List<object>();
                        Items(']', () => list.Add(Value()));
                        return list;
                    case '"':
                        return Text();
                    default:
                        var begin = at;
                        while (at < text.Length && "+-.eE0123456789".IndexOf(text[at]) >= 0) ++at;
                        double number;
                        if (double.TryParse(text.Substring(begin, at - begin), NumberStyles.Float,
                                            CultureInfo.InvariantCulture, out number))
                            return number;
                        throw Wrong();
                }
            }

            private void Items(char end, Action item)
            {
                ++at;
                if (Next() == end) { ++at; return; }
                for (;;)
                {
                    item();
                    var after = Next();
                    ++at;
                    if (after == end) return;
                    if (after != ',') throw Wrong();
                }
            }

            private string Text()
            {
                var end = text.IndexOf('"', at + 1);
                if (end < 0) throw Wrong();
                var found = text.Substring(at + 1, end - at - 1);
                at = end + 1;
                return found;
            }

            private char Next()
            {
                while (at < text.Length && char.IsWhiteSpace(text[at])) ++at;
                return at < text.Length ? text[at] : '\0';
            }

            private ArgumentException Wrong() => new ArgumentException("JSON parse error at " + at);
        }
    }
}
